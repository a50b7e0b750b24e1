"""Our robot, a real process, on a server and with a dashboard of the original project: they must notice no difference.

Every test also fails by whatever the original server's strict parser would refuse (see conftest).
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from typing import Any

import pytest

from mosaic_core.machines.peers.peer_of_robot import TIMEOUTS

pytestmark = pytest.mark.webrtc

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
NO_AUTHORIZATION = f"{{ type: no-authorization, robot_id: {ROBOT_ID} }}"
LINK = "  - { type: connection-check, label: link }\n"
LOAD = "  - { type: host-load, label: load, params: { period_s: 0.2 } }\n"
CAMERAS = """\
  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 10 } }
  - { type: test-pattern, label: rear, params: { width: 160, height: 120, fps: 10 } }
"""
BASE = """\
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.02 } }
"""
FORWARD = json.dumps({"linear": {"x": 0.4, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}})
CLOSINGS = ("signaling.close_peer_connection", "signaling.close_connection", "signaling.send_close_peer_connection")


CANDIDATE = '{"candidate":"candidate:1","sdpMid":"0","sdpMLineIndex":0}'
TRICKLED = '{"type":"signaling.exchange_ice_candidate","data":{"rtcConnectionId":"a","iceCandidate":%s}}'


def test_the_strict_reader_takes_what_the_original_takes(original_server: Any) -> None:
    for text in ('{"type":"status.update","data":{"status":0}}', TRICKLED % CANDIDATE):
        assert original_server.read(text, True) == json.loads(text)
    assert original_server.violations == []


@pytest.mark.parametrize(
    "text",
    [
        b'{"type":"status.update","data":{"status":0}}',
        "{",
        "[1]",
        '{"type":"status.update"}',
        '{"type":"status.update","data":null}',
        '{"type":"status.update","data":{"status":0},"id":1}',
        '{"type":"status.update","data":{"status":0,"robotId":"a"}}',
        '{"type":"status.update","data":{"status":"0"}}',
        '{"type":"status.update","data":{"status":true}}',
        '{"type":"catalogue.announce","data":{"catalogue":{}}}',
        '{"type":"authorize","data":{"robotId":"a"}}',
        '{"type":"authorize","data":{"robotId":"a","data":"b","extensions":{}}}',
        TRICKLED % CANDIDATE.replace("}", ',"usernameFragment":"u"}'),
        TRICKLED % CANDIDATE.replace('"0"', "null"),
        TRICKLED % "null",
    ],
)
def test_the_strict_reader_refuses_what_the_original_refuses(original_server: Any, text: str | bytes) -> None:
    assert original_server.read(text, True) is None
    assert len(original_server.violations) == 1


def test_the_strict_reader_refuses_everything_but_authorize_before_authorization(original_server: Any) -> None:
    assert original_server.read('{"type":"status.update","data":{"status":0}}', False) is None
    assert original_server.read('{"type":"authorize","data":{"robotId":"a","data":"b"}}', False) is not None
    assert len(original_server.violations) == 1


async def test_authorization_carries_the_robot_id_and_the_token_and_the_status_follows_it(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        await site.is_alive()
        first, second, *_ = site.server.frames
        assert first == {"type": "authorize", "data": {"robotId": ROBOT_ID, "data": "b2xkIHN0eWxl+/=="}}
        assert second == {"type": "status.update", "data": {"status": 0}}
        assert not site.server.said("catalogue.announce")
    assert site.server.statuses == [0, 5]


async def test_a_robot_without_a_token_sends_its_id_alone(original_robot: Any) -> None:
    async with original_robot(LINK, auth=NO_AUTHORIZATION) as site:
        assert site.server.said("authorize") == [{"robotId": ROBOT_ID}]


async def test_an_original_dashboard_gets_bare_texts_and_verbatim_echoes(original_robot: Any, until: Any) -> None:
    async with original_robot(LINK + LOAD) as site:
        page = site.operator("load", "link-sender", "link-receiver", "nobody-here")
        await page.connect()
        await site.server.sees(0, 1, 2)
        await until(lambda: len(page.received["load"]) > 2, "three readings")
        assert {"cpu_percent", "memory_percent"} <= set(page.objects("load")[0])

        said = [
            '{"messageCreated": 1763695381000.25 }',
            '{"messageCreated":1,"extra":"' + "x" * 60_000 + '"}',
            "ä €",
        ]
        for text in said:
            page.channels["link-receiver"].send(text)
        await until(lambda: len(page.received["link-sender"]) >= len(said), "the echoes")
        assert page.received["link-sender"] == said
        assert page.received["link-receiver"] == []

        page.channels["nobody-here"].send("anybody?")
        page.channels["link-receiver"].send("after it")
        await until(lambda: page.received["link-sender"][-1] == "after it", "the robot goes on")
        assert page.channels["nobody-here"].readyState == "open"
        assert page.received["nobody-here"] == []

        await page.hang_up()
        await site.server.sees(0, 1, 2, 3, 0)


async def test_the_largest_check_message_of_the_original_dashboard_comes_back(original_robot: Any, until: Any) -> None:
    """Its DelayCheck widget sends 250 × 1024 characters in one message."""

    async with original_robot(LINK) as site:
        page = site.operator("link-sender", "link-receiver")
        await page.connect()
        said = json.dumps({"messageCreated": 1763695381000, "extra": "x" * (250 * 1024)})
        page.channels["link-receiver"].send(said)
        await until(lambda: page.received["link-sender"], "the echo")
        assert page.received["link-sender"] == [said]


async def test_every_camera_arrives_on_a_stream_that_bears_its_label(original_robot: Any) -> None:
    async with original_robot(CAMERAS) as site:
        page = site.operator("unused", videos=2)
        await page.connect()
        assert page.streams == ["front front", "rear rear"]
        assert [track.id for track in page.tracks] == ["front", "rear"]
        pictures = await asyncio.wait_for(asyncio.gather(*(track.recv() for track in page.tracks)), 20)
        assert [(it.width, it.height) for it in pictures] == [(320, 240), (160, 120)]
        assert all(it.to_ndarray(format="gray").std() > 20 for it in pictures)


async def test_a_dashboard_that_asks_for_fewer_pictures_gets_the_first_and_one_that_asks_for_more_still_connects(
    original_robot: Any,
) -> None:
    async with original_robot(CAMERAS) as site:
        for lines, labels in ((1, ["front"]), (3, ["front", "rear"])):
            page = site.operator("unused", videos=lines)
            await page.connect()
            assert page.streams == [f"{label} {label}" for label in labels]
            assert [track.id for track in page.tracks] == labels
            await asyncio.wait_for(page.tracks[0].recv(), 20)
        await site.server.sees(0, 1, 2, 3, 0, 1, 2)


async def test_a_twist_moves_the_base_and_silence_stops_it(original_robot: Any, until: Any) -> None:
    async with original_robot(BASE) as site:
        page = site.operator("cmd_vel", "pose")
        await page.connect()
        await until(lambda: page.received["pose"], "a pose")

        def speed_mps() -> float:
            return float(page.objects("pose")[-1]["twist"]["linear"]["x"])

        def place() -> tuple[float, float]:
            position = page.objects("pose")[-1]["position"]
            return position["x"], position["y"]

        start = place()
        for _ in range(10):
            page.channels["cmd_vel"].send(FORWARD)
            await asyncio.sleep(0.1)
        assert math.dist(start, place()) > 0.15
        assert speed_mps() > 0.3
        silent_at_s = time.monotonic()
        await until(lambda: speed_mps() < 0.01, "the base stands", 5)
        assert time.monotonic() - silent_at_s < 1.5  # 0.3 s of silence, then braking
        stood = place()
        seen = len(page.received["pose"])
        await until(lambda: len(page.received["pose"]) > seen + 10, "more poses")
        assert math.dist(stood, place()) < 0.01
        page.channels["cmd_vel"].send("{}")  # the original would take it for a stop; ours refuses, and stays up
        await site.is_alive()


async def test_a_second_operator_takes_the_place_of_the_first(original_robot: Any, until: Any) -> None:
    async with original_robot(LINK) as site:
        first = site.operator("link-sender", "link-receiver")
        await first.connect()
        second = site.operator("link-sender", "link-receiver")
        await second.connect()
        await site.server.sees(0, 1, 2, 3, 0, 1, 2)
        await until(lambda: first.pc.connectionState == "closed", "the first one is told")
        second.channels["link-receiver"].send("mine now")
        await until(lambda: second.received["link-sender"] == ["mine now"], "the echo")
        await first.hang_up()  # a late word of the first one must not end the second
        await site.is_alive()
        assert second.pc.connectionState == "connected"
        await second.hang_up()
        await site.server.sees(0, 1, 2, 3, 0, 1, 2, 3, 0)


async def test_an_offer_while_another_is_being_connected_wins(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        ghost = site.operator("link-sender")
        await ghost.prepare()
        await ghost.send_offer(await ghost.describe())
        await site.server.sees(0, 1)
        page = site.operator("link-sender")
        await page.connect()
        await site.server.sees(0, 1, 0, 1, 2)


async def test_an_offer_repeated_under_the_same_id_starts_over(original_robot: Any) -> None:
    """A page that lost its first attempt may reuse the id that the server gave it."""

    async with original_robot(LINK) as site:
        first = site.operator("link-sender")
        await first.connect()
        await site.server.sees(0, 1, 2)
        again = site.operator("link-sender", peer_id=first.id)
        await again.connect()
        await site.server.sees(0, 1, 2, 3, 0, 1, 2)
        await again.hang_up()
        await site.server.sees(0, 1, 2, 3, 0, 1, 2, 3, 0)


async def test_candidates_before_the_offer_do_no_harm_whatever_their_spelling(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender")
        sdp = await page.describe()
        await page.trickle()  # before anything is known of the connection: lost
        await page.prepare()
        await page.trickle("signaling.send_ice_candidate")
        await page.send_offer(sdp)
        await page.trickle()
        await site.server.sees(0, 1, 2)

        only_early = site.operator("link-sender")
        sdp = await only_early.describe()
        await only_early.prepare()
        await only_early.trickle("signaling.send_ice_candidate")
        await only_early.send_offer(sdp)
        await site.server.sees(0, 1, 2, 3, 0, 1, 2)


async def test_candidates_that_make_no_sense_are_left_out(original_robot: Any) -> None:
    odd: list[Any] = [
        {"candidate": "", "sdpMid": "0", "sdpMLineIndex": None},
        {"candidate": "candidate:nonsense", "sdpMid": "0", "sdpMLineIndex": 0},
        {"candidate": "candidate:1 1 udp 1 gone.invalid 9 typ host", "sdpMid": "77", "sdpMLineIndex": 77},
        {"candidate": None, "sdpMid": None, "sdpMLineIndex": None},
        None,
    ]

    async with original_robot(LINK) as site:
        page = site.operator("link-sender")
        sdp = await page.describe()
        sound, page.candidates = page.candidates, odd
        await page.prepare()
        await page.trickle()
        await page.send_offer(sdp)
        await page.trickle()
        page.candidates = sound
        await page.trickle()
        await site.server.sees(0, 1, 2)


async def test_a_server_that_prepares_nothing_is_served_as_well(original_robot: Any) -> None:
    """Before `prepare_connection` was added, the id came with the offer alone."""

    async with original_robot(LINK) as site:
        page = site.operator("link-sender")
        await page.send_offer(await page.describe())
        await page.trickle()
        await site.server.sees(0, 1, 2)


async def test_an_operator_that_never_appears_leaves_the_robot_free_again(original_robot: Any) -> None:
    """Bounded by the longest phase of the peer session, 20 s: a slow TURN server is given that time."""

    async with original_robot(LINK) as site:
        ghost = site.operator("link-sender")
        sdp = await ghost.describe()
        await ghost.pc.close()
        await ghost.prepare()
        await ghost.send_offer(sdp)
        ghost.answered = _ignore
        await site.server.sees(0, 1)
        await site.server.sees(0, 1, 0, timeout_s=TIMEOUTS["connecting"][0] + 5)
        page = site.operator("link-sender")
        await page.connect()
        await site.server.sees(0, 1, 0, 1, 2)


async def _ignore(_sdp: str) -> None:
    """Nobody is there to take the answer."""


async def test_an_offer_that_nobody_can_read_leaves_the_robot_free_again(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        page = site.operator()
        await page.prepare()
        await page.send_offer("v=0\r\nthis is no session description")
        await site.server.sees(0, 1, 0)


async def test_every_spelling_of_closing_ends_the_session_also_before_it_is_connected(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        told = [0]
        for closing in CLOSINGS:
            page = site.operator("link-sender")
            await page.connect()
            await page.hang_up(closing)
            told += [1, 2, 3, 0]
            await site.server.sees(*told)
        ghost = site.operator("link-sender")
        await ghost.prepare()
        await ghost.send_offer(await ghost.describe())
        await site.server.sees(*told, 1)
        await ghost.hang_up()
        await site.server.sees(*told, 1, 0)


async def test_a_page_that_closes_without_a_word_leaves_the_robot_free_again(original_robot: Any) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender")
        await page.connect()
        await page.pc.close()
        await site.server.sees(0, 1, 2, 3, 0)


async def test_a_robot_that_is_stopped_closes_the_session_and_says_disconnected_last(
    original_robot: Any, until: Any
) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender")
        await page.connect()
        site.stop_robot()
        await site.server.sees(0, 1, 2, 3, 0, 5)
        await until(lambda: page.pc.connectionState == "closed", "the page is told")


async def test_error_echoes_and_nonsense_of_the_server_change_nothing(original_robot: Any, until: Any) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender", "link-receiver")
        await page.connect()
        for kind, code in (
            ("status.update.res", 10000), ("unknown.res", 10001), ("signaling.send_sdp_answer", 10053),
            ("signaling.send_ice_candidate", 10002), ("null.res", 10000), ("ping.pong", 10002),
            ("authorize", 20001), ("authorize.res", 10021),
        ):  # fmt: skip
            await site.server.push(kind, code)
        for text in ("", "{", "[]", "null", '{"type":1,"data":null}', '{"data":{}}', '{"type":"force_logout"}',
                     '{"type":"signaling.send_sdp_offer","data":{"rtcConnectionId":7}}'):  # fmt: skip
            await site.server.push_text(text)
        await site.server.push("authorize.res", {"an": "object"})
        await site.is_alive()
        page.channels["link-receiver"].send("still here")
        await until(lambda: page.received["link-sender"] == ["still here"], "the echo")
        await site.server.sees(0, 1, 2)
        assert len(site.server.authorized_at_s) == 1


async def test_a_session_outlives_its_server_and_the_status_is_told_to_the_next_one(
    original_robot: Any, until: Any
) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender", "link-receiver")
        await page.connect()
        await site.server.sees(0, 1, 2)
        await site.server.close()
        page.channels["link-receiver"].send("without a server")
        await until(lambda: page.received["link-sender"] == ["without a server"], "the echo")
        await site.server.open()
        await site.server.sees(0, 1, 2, 2)
        await page.hang_up()
        await site.server.sees(0, 1, 2, 2, 3, 0)


async def test_a_refused_robot_goes_on_says_so_once_and_asks_again_with_patience(
    original_robot: Any, until: Any
) -> None:
    """Two robots at once, as each waits 21 to 30 s after its first refusal. A lost socket is tried after 0.5 s."""
    refused, unknown = {"type": "authorize.res", "data": 10021}, {"type": "authorize", "data": 20001}

    async def retried_twice() -> None:
        async with original_robot(LINK, refusals=[refused, unknown]) as site:
            await until(lambda: len(site.server.authorized_at_s) >= 2, "the second try", 40)
            gap_s = site.server.authorized_at_s[1] - site.server.authorized_at_s[0]
            assert 20 < gap_s < 32
            seen = len(site.snapshots)
            await until(lambda: len(site.snapshots) > seen + 2, "it goes on")
            assert site.snapshots[-1]["state"] == "offline"
            assert len(site.server.authorized_at_s) == 2
            told = [line for line in site.log if "auth.failed" in line]
            assert len(told) == 1, told
            assert "token" in told[0]
            assert "b2xkIHN0eWxl" not in "".join(site.log)
            assert site.server.statuses == []

    async def accepted_later() -> None:
        async with original_robot(LINK, refusals=[unknown]) as site:
            await site.server.sees(0, timeout_s=40)
            page = site.operator("link-sender")
            await page.connect()
            await site.server.sees(0, 1, 2)

    await asyncio.gather(retried_twice(), accepted_later())
