"""The robot between an in-memory server and in-memory operators."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import numpy as np
import pytest
from pydantic import field_validator

from mosaic_core import (
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    MediaTrackHandler,
    Message,
    Refused,
    Sender,
    Shared,
)
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer
from mosaic_core.words.control import Bye, MediaWatch, Ping
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import SignalingError


class Counter(DataChannelSendable[dict[str, Any]]):
    def __init__(self, label: str, period_s: float = 0.01) -> None:
        super().__init__(label)
        self.period_s = period_s
        self.left_in: str | None = None

    def messages(self) -> Iterator[dict[str, Any]]:
        try:
            for number in self.every(self.period_s):
                yield {"number": number}
        finally:
            self.left_in = threading.current_thread().name


class Base(DataChannelJsonReceivable):
    """Moves; ``log`` is what happened, in order."""

    timeout_s = 0.15

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.log: list[Any] = []

    def handle_data(self, data: dict[str, Any], sender: Sender) -> None:
        if data.get("refuse"):
            raise Refused("safety.not_finite", "no")
        if data.get("break"):
            raise RuntimeError("motor gone")
        self.log.append((data.get("v"), sender.peer_id))

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)

    def peer_left(self, sender: Sender) -> None:
        self.log.append(f"left {sender.peer_id}")


class CountedCamera(MediaTrackHandler):
    runs_now = 0

    def frames(self) -> Iterator[Any]:
        self.runs_now += 1
        try:
            for number in self.every(0.005):
                yield np.full((2, 2), number % 256, np.uint8)
        finally:
            self.runs_now -= 1


async def test_an_original_server_gets_exactly_its_own_keys_and_the_statuses_in_order(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await scene.network.ready()
        assert socket.got("authorize") == [{"robotId": scene.robot.robot_id, "data": "secret"}]
        operator = await scene.network.offer()
        await kit.until(lambda: socket.got("signaling.exchange_ice_candidate"))
        operator.listener.state_changed("connected")
        operator.listener.state_changed("closed")
        await kit.until(lambda: len(socket.got("status.update")) == 5)
        assert [update["status"] for update in socket.got("status.update")] == [0, 1, 2, 3, 0]
        assert socket.got("signaling.send_sdp_answer") == [{"rtcConnectionId": "p1", "sdpAnswer": "answer"}]
        kinds = [message["type"] for message in socket.sent if message["type"].startswith("signaling.")]
        assert kinds == ["signaling.send_sdp_answer", "signaling.exchange_ice_candidate"]
        [candidate] = socket.got("signaling.exchange_ice_candidate")
        assert candidate["iceCandidate"].keys() == {"candidate", "sdpMid", "sdpMLineIndex"}
        assert all(message.keys() == {"type", "data"} for message in socket.sent)
    assert socket.got("status.update")[-1] == {"status": 5}


async def test_an_operator_hears_hello_catalogue_messages_and_pong(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        operator, control = await scene.greeted()
        assert control.heard("hello")[0].software == "mosaic-test"
        assert control.heard("catalogue")[0].catalogue == scene.robot.catalogue
        channel = operator.open("count")
        await kit.until(lambda: len(channel.values()) > 3)
        numbers = [value["number"] for value in channel.values(latched=False)]
        assert numbers == sorted(numbers)
        assert [frame.seq for frame in channel.frames()] == list(range(1, len(channel.frames()) + 1))
        control.say(Ping(t0=5))
        await kit.until(lambda: control.heard("pong"))
        pong = control.heard("pong")[0]
        assert pong.t0 == 5
        assert pong.t1 <= pong.t2
        assert scene.robot.peers[0].peer_id == "p1"
        [row] = scene.robot.snapshot().connectors
        assert (row.peers, row.state) == (1, "running")
        assert row.rate_hz > 0


async def test_a_late_joiner_gets_the_last_value_marked_as_latched(kit: Any) -> None:
    class Once(DataChannelSendable[dict[str, Any]]):
        def messages(self) -> Iterator[dict[str, Any]]:
            yield {"map": 1}

    async with kit.running(kit.connector_of(Once("map")), kit.connector_of(Once("raw"))) as scene:
        await scene.network.ready()
        await kit.until(lambda: [row.state for row in scene.robot.snapshot().connectors] == ["ended", "ended"])
        operator = await scene.network.offer()
        await operator.greet()
        late = operator.open("map")
        assert late.values(latched=True) == [{"map": 1}]
        assert operator.open("raw", "").sent == []


async def test_an_original_operator_gets_bare_text_and_every_camera(kit: Any) -> None:
    camera, base = CountedCamera("front"), Base("drive")

    parts = [kit.connector_of(Counter("count")), kit.connector_of(camera), kit.connector_of(base)]
    async with kit.running(*parts) as scene:
        operator = await scene.offered()
        operator.listener.state_changed("connected")
        channel = operator.open("count", "")
        await kit.until(lambda: channel.sent)
        assert channel.sent[0].startswith('{"number":')
        kind, image, _captured_at_s = await asyncio.wait_for(operator.feeds["front"].next(), 2)
        assert (kind, image.shape) == ("prepared", (2, 2))
        drive = operator.open("drive", "")
        drive.say({"v": 1})
        await kit.until(lambda: (1, "p1") in base.log)
        unknown = operator.open("nothing", "")
        assert unknown.is_open


async def test_a_camera_runs_only_while_somebody_watches(kit: Any) -> None:
    camera = CountedCamera("front")

    async with kit.running(kit.connector_of(camera), kit.connector_of(CountedCamera("rear"))) as scene:
        operator, control = await scene.greeted(sdp="offer:1")
        assert [note.label for note in control.heard("media.unavailable")] == ["rear"]
        assert camera.runs_now == 0
        control.say(MediaWatch(label="front", on=True))
        await asyncio.wait_for(operator.feeds["front"].next(), 2)
        assert camera.runs_now == 1
        control.say(MediaWatch(label="front", on=False))
        await kit.until(lambda: camera.runs_now == 0)
        control.say(MediaWatch(label="front", on=True))
        await kit.until(lambda: camera.runs_now == 1)
        control.say(MediaWatch(label="nowhere", on=True))
        control.say(MediaWatch(label="rear", on=True))
        await kit.until(lambda: len(control.heard("media.unavailable")) == 3)
        codes = [note.code for note in control.heard("media.unavailable")]
        assert codes == ["media.no_line", "channel.unknown_label", "media.no_line"]
        control.say(Bye())
        await kit.until(lambda: camera.runs_now == 0)


async def test_silence_stops_the_base_and_a_refused_command_does_not_keep_it_alive(kit: Any) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base, delivery=Delivery.LATEST)) as scene:
        operator, control = await scene.greeted()
        drive = operator.open("drive")
        drive.say({"v": 1})
        await kit.until(lambda: base.log)
        for number in range(1, 21):  # the next one only then: it would take its place
            drive.say({"refuse": True})
            await kit.until(lambda number=number: scene.robot.snapshot().connectors[0].refused == number)
            await asyncio.sleep(0.01)
        assert base.log == [(1, "p1"), "safety.timeout"]
        assert control.heard("refusal")[0].code == "safety.not_finite"
        assert len(control.heard("refusal")) >= 10, "each of the first ten is told"


@pytest.mark.parametrize(
    ("payload", "code"),
    [
        ('{"v": NaN}', "safety.not_finite"),
        ('{"a": [{"v": 1e999}]}', "safety.not_finite"),
        ("[1]", "channel.invalid"),
        ("{", "channel.invalid"),
    ],
)
async def test_what_does_not_fit_is_refused_and_counted(kit: Any, payload: str, code: str) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base)) as scene:
        operator, control = await scene.greeted()
        seq = operator.open("drive").say(payload)
        await kit.until(lambda: control.heard("refusal"))
        [refusal] = control.heard("refusal")
        assert (refusal.label, refusal.seq, refusal.code) == ("drive", seq, code)
        assert base.log == []
        assert scene.robot.snapshot().connectors[0].refused == 1
        assert scene.hooks.of("command") == [{"label": "drive", "accepted": False, "code": code}]


async def test_stale_and_overtaken_commands_never_act(kit: Any) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base, delivery=Delivery.LATEST)) as scene:
        operator, control = await scene.greeted()
        drive = operator.open("drive")
        drive.stamp_offset_s = control.channel.stamp_offset_s = 3600.0
        drive.say({"v": 1}, seq=10)
        await kit.until(lambda: base.log)
        drive.say({"v": 2}, seq=9)
        drive.say({"v": 3}, seq=11, age_s=1.0)
        await kit.until(lambda: scene.robot.snapshot().connectors[0].refused == 2)
        assert {note.code for note in control.heard("refusal")} == {"safety.out_of_order", "safety.stale"}
        assert [entry for entry in base.log if isinstance(entry, tuple)] == [(1, "p1")]


async def test_the_base_stops_when_its_operator_leaves_and_not_when_another_one_does(kit: Any) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base, timeout_s=5.0)) as scene:
        socket = await _our_server(kit, scene)
        await _our_offer(kit, scene, "p1")
        await _our_offer(kit, scene, "p2")
        await _our_offer(kit, scene, "p3")
        first, second, third = scene.network.order
        channels = []
        for operator in (first, second, third):
            control = await operator.greet()
            channels.append((control, operator.open("drive")))
        channels[0][1].say({"v": 1})
        await kit.until(lambda: base.log)
        channels[1][0].say(Bye())
        await kit.until(lambda: "left p2" in base.log)
        assert "safety.peer_left" not in base.log
        channels[0][0].say(Bye())
        await kit.until(lambda: "left p1" in base.log)
        assert base.log == [(1, "p1"), "left p2", "safety.peer_left", "left p1"]
        assert len(scene.robot.peers) == 1
        assert {update["status"] for update in socket.got("status.update")} == {0}


async def _our_server(kit: Any, scene: Any) -> Any:
    """A server of ours that agreed on everything but tickets."""
    extensions = {"catalogue": 1, "multiPeer": 1, "closeReasons": 1, "future": 7}
    await kit.until(lambda: scene.network.sockets)
    socket = scene.network.socket
    socket.push("authorize.req", {"extensions": extensions})
    await kit.until(lambda: any(message.get("extensions") for message in socket.got("authorize")))
    socket.push("authorize.res", 100)
    socket.push("session.welcome", {"server": "test", "extensions": extensions})
    await kit.until(lambda: socket.got("catalogue.announce"))
    return socket


async def _our_offer(kit: Any, scene: Any, peer_id: str) -> Any:
    return await scene.network.offer(peer_id)


async def test_a_silent_operator_is_lost_within_two_seconds_and_the_server_learns_why(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mosaic_core.machines.peers.peer_of_robot.PEER_LOST_AFTER_S", 0.2)
    base = Base("drive")

    async with kit.running(kit.connector_of(base, timeout_s=5.0)) as scene:
        socket = await _our_server(kit, scene)
        operator = await _our_offer(kit, scene, "p1")
        control = await operator.greet()
        operator.open("drive").say({"v": 1})
        for _ in range(10):
            await asyncio.sleep(0.05)
            control.say(Ping(t0=1))
        assert scene.robot.peers
        await kit.until(lambda: "safety.peer_left" in base.log, timeout_s=4.0)  # its silence alone is noticed after 5 s
        await kit.until(lambda: operator.is_closed)
        closes = socket.got("signaling.close_peer_connection")
        assert [(close["rtcConnectionId"], close["code"]) for close in closes] == [("p1", "peer.lost")]
        assert [call["code"] for call in scene.hooks.of("closed")] == ["peer.lost"]


async def test_a_server_restart_leaves_peers_and_handlers_alone(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await scene.network.ready()
        operator = await scene.network.offer()
        control = await operator.greet()
        channel = operator.open("count")
        await kit.until(lambda: channel.sent)
        socket.drop(1012)
        await kit.until(lambda: scene.robot.state == "offline")
        sent = len(channel.sent)
        await kit.until(lambda: len(channel.sent) > sent + 3)
        await kit.until(lambda: len(scene.network.sockets) == 2)
        again = await scene.network.ready()
        assert again.got("status.update") == [{"status": 2}], "toward an original server: still connected"
        assert not control.heard("bye")
        numbers = [value["number"] for value in channel.values(latched=False)]
        assert numbers == sorted(numbers), "the handler was never restarted"


async def test_a_server_that_is_down_is_reported_once_and_tried_again(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    async with kit.running(kit.connector_of(Counter("count")), down=True) as scene:
        await kit.until(lambda: scene.network.attempts >= 3)
        assert caplog.text.count("connection refused") == 1
        scene.network.is_down = False
        await scene.network.ready()
        assert scene.robot.state == "ready"
    assert "The server is there again" in caplog.text


async def test_a_robot_that_was_replaced_stops_and_says_so(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await scene.network.ready()
        task = next(task for task in asyncio.all_tasks() if "Robot.run" in repr(task.get_coro()))
        socket.drop(4409)
        with pytest.raises(SignalingError) as caught:
            await asyncio.wait_for(asyncio.shield(task), 3)
        assert caught.value.code == "signal.replaced"
        assert scene.network.attempts == 1


async def test_a_connection_is_closed_once_the_operator_has_the_good_bye_and_not_before(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mosaic_core.runtime.peers.peer._BYE_CHECKS", 100_000)
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        first, control = await scene.greeted("p1")
        control.channel.under_way_bytes = 100
        await scene.network.offer("p2")
        await kit.until(lambda: control.heard("bye"))
        assert not first.is_closed
        control.channel.under_way_bytes = 0
        await kit.until(lambda: first.is_closed)


async def test_whoever_confirms_no_good_bye_is_waited_for_half_a_second(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        first, control = await scene.greeted("p1")
        control.channel.under_way_bytes = 100
        await scene.network.offer("p2")
        assert await kit.until(lambda: first.is_closed) >= 0.4


async def test_the_newest_offer_replaces_the_peer_of_an_original_server_in_order(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await scene.network.ready()
        first = await scene.network.offer("p1")
        control = await first.greet()
        await scene.network.offer("p2")
        await kit.until(lambda: first.is_closed)
        assert control.heard("bye")[0].code == "peer.replaced"
        await kit.until(lambda: len(socket.got("status.update")) == 6)
        assert [update["status"] for update in socket.got("status.update")] == [0, 1, 2, 3, 0, 1]


async def test_an_offer_that_can_not_be_answered_ends_with_its_reason(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await _our_server(kit, scene)
        await scene.network.offer("p1", sdp="bad")
        await kit.until(lambda: socket.got("signaling.close_peer_connection"))
        assert socket.got("signaling.close_peer_connection")[0]["code"] == "sdp.no_common_codec"
        assert scene.robot.peers == ()


async def test_a_peer_that_ended_while_its_offer_was_answered_leaves_nothing_bound(kit: Any) -> None:
    async with kit.running(kit.connector_of(CountedCamera("front"))) as scene:
        socket = await scene.network.ready()
        operator = await scene.network.offer("p1")
        socket.push("signaling.close_peer_connection", {"rtcConnectionId": "p1"})
        await kit.until(lambda: operator.is_closed)
        assert operator.listener.media.track_bound("front") is not None, "aiortc goes on with what it has begun"
        assert not scene.robot._running.runs.media.is_bound("p1", "front")


async def test_unknown_labels_and_messages_to_a_sender_are_refused_by_name(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        operator, control = await scene.greeted()
        assert not operator.open("cuont").is_open
        operator.open("count").say({"v": 1})
        await kit.until(lambda: len(control.heard("refusal")) == 2)
        codes = {(note.label, note.code) for note in control.heard("refusal")}
        assert codes == {("cuont", "channel.unknown_label"), ("count", "channel.wrong_direction")}


async def test_candidates_that_come_right_behind_the_offer_are_used(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        socket = await _our_server(kit, scene)
        offering = asyncio.create_task(scene.network.offer("p1"))
        await asyncio.sleep(0)  # the offer waits in the socket, and the candidate behind it
        candidate = {"candidate": "candidate:7 1 udp 1 10.0.0.2 5000 typ host", "sdpMid": "0"}
        socket.push("signaling.exchange_ice_candidate", {"rtcConnectionId": "p1", "iceCandidate": candidate})
        operator = await offering
        await kit.until(lambda: [one.candidate for one in operator.candidates] == [candidate["candidate"]])


async def test_the_connection_check_echoes_verbatim_to_the_one_who_asked(kit: Any) -> None:
    configurer = ConnectionCheckConfigurer("check", ConnectionCheckConfigurer.params_model())  # type: ignore[arg-type]
    receiver, sender = configurer.configure()

    async with kit.running(kit.connector_of(receiver, sender, label="check")) as scene:
        await _our_server(kit, scene)
        texts = []
        for peer_id in ("p1", "p2"):
            operator = await scene.network.offer(peer_id)
            operator.listener.state_changed("connected")
            texts.append((operator.open("check-receiver", ""), operator.open("check-sender", "")))
        (asks, hears), (_, other) = texts
        asks.say('{"messageCreated": 1.5, "extra":"x"}')
        await kit.until(lambda: hears.sent)
        assert hears.sent == ['{"messageCreated": 1.5, "extra":"x"}']
        assert other.sent == []


async def test_a_failing_receiver_rests_reports_and_comes_back(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base)) as scene:
        operator, control = await scene.greeted()
        drive = operator.open("drive")
        drive.say({"break": True})
        drive.say({"v": 1})
        await kit.until(lambda: len(scene.hooks.of("command")) == 2)
        assert [call["code"] for call in scene.hooks.of("command")] == ["plugin.failed", "plugin.failed"]
        assert isinstance(scene.hooks.of("failed")[0]["error"], RuntimeError)
        assert scene.robot.snapshot().connectors[0].state == "failed"
        assert "motor gone" in scene.robot.snapshot().connectors[0].last_error
        await asyncio.sleep(scene.hooks.of("failed")[0]["restart_in_s"])
        await kit.until(lambda: scene.robot.snapshot().connectors[0].state == "running")
        drive.say({"v": 2})
        await kit.until(lambda: (2, "p1") in base.log)
        assert scene.robot.snapshot().connectors[0].state == "running"
        assert control.heard("refusal")[0].code == "plugin.failed"


async def test_what_one_operator_breaks_costs_no_other_its_message_and_its_text_stays_on_the_robot(kit: Any) -> None:
    base = Base("drive")

    async with kit.running(kit.connector_of(base)) as scene:
        await _our_server(kit, scene)
        ann, bob = await scene.network.offer("p1"), await scene.network.offer("p2")
        control, _ = await ann.greet(), await bob.greet()
        anns, bobs = ann.open("drive"), bob.open("drive")
        anns.say({"break": True})
        await kit.until(lambda: scene.hooks.of("failed"))
        bobs.say({"v": 2})
        await kit.until(lambda: (2, "p2") in base.log)
        anns.say({"v": 3})
        await kit.until(lambda: len(control.heard("refusal")) == 2)
        broke, rests = control.heard("refusal")
        assert (broke.code, broke.gate, rests.code, rests.gate) == ("plugin.failed", "handler", "plugin.failed", "rest")
        assert broke.message == "'drive' could not carry it out; the robot's log says why"
        assert "motor gone" not in f"{broke.message} {rests.message}"


class LeavingAsync(DataChannelJsonReceivable):
    async def handle_data(self, data: dict[str, Any]) -> None:
        raise SystemExit(3)


class LeavingMessage(Message):
    speed: float

    @field_validator("speed")
    @classmethod
    def check(cls, speed: float) -> float:
        raise SystemExit(3)


class LeavingValidator(DataChannelReceivable[LeavingMessage]):
    def handle_data(self, data: LeavingMessage) -> None: ...


class LeavingAsyncValidator(DataChannelReceivable[LeavingMessage]):
    async def handle_data(self, data: LeavingMessage) -> None: ...


@pytest.mark.parametrize("made", [LeavingAsync, LeavingValidator, LeavingAsyncValidator])
async def test_sys_exit_in_a_receiver_is_a_failure_and_the_robot_goes_on(kit: Any, made: Callable[[str], Any]) -> None:
    async with kit.running(kit.connector_of(made("in"))) as scene:
        operator, _ = await scene.greeted()
        operator.open("in").say({"speed": 1.0})
        await kit.until(lambda: scene.hooks.of("failed"))
        assert isinstance(scene.hooks.of("failed")[0]["error"], SystemExit)


async def test_stop_is_orderly_quick_and_makes_everything_safe(kit: Any) -> None:
    class World:
        entered = 0

        def __enter__(self) -> World:
            self.entered += 1
            return self

        def __exit__(self, *_: object) -> None:
            self.entered -= 1

    base, counter, world, shared = Base("drive"), Counter("count", period_s=60), World(), Shared()
    shared.get("world", lambda: world)

    async with kit.running(kit.connector_of(base), kit.connector_of(counter), shared=shared) as scene:
        socket = await scene.network.ready()
        operator = await scene.network.offer()
        control = await operator.greet()
        operator.open("drive").say({"v": 1})
        await kit.until(lambda: base.log)
        assert world.entered == 1
        before_s = time.monotonic()
        scene.robot.stop()
        await kit.until(lambda: world.entered == 0)
        assert time.monotonic() - before_s < 5
        assert "safety.shutdown" in base.log
        assert control.heard("bye")[0].code == "peer.shutdown"
        assert operator.is_closed
        assert counter.left_in == "mosaic-count", "the generator was closed on its own thread"
        assert socket.closed_by_robot == 1000
        assert scene.hooks.of("state")[-1] == {"state": "stopped"}


async def test_a_body_that_ignores_stop_is_abandoned_by_name(kit: Any, caplog: pytest.LogCaptureFixture) -> None:
    release = threading.Event()

    class Deaf(DataChannelSendable[dict[str, Any]]):
        def messages(self) -> Iterator[dict[str, Any]]:
            release.wait(10)
            yield {}

    async with kit.running(kit.connector_of(Deaf("deaf"))) as scene:
        await kit.until(lambda: [row.state for row in scene.robot.snapshot().connectors] == ["running"])
        before_s = time.monotonic()
    assert time.monotonic() - before_s < 5
    release.set()
    assert "'deaf' did not stop" in caplog.text


async def test_an_async_sender_and_an_async_receiver_share_the_loop(kit: Any) -> None:
    class Ticks(DataChannelSendable[dict[str, Any]]):
        async def messages(self) -> AsyncIterator[dict[str, Any]]:
            async for number in self.every(0.005):
                yield {"number": number}

    class Async(DataChannelJsonReceivable):
        got: list[Any] = []  # noqa: RUF012

        async def handle_data(self, data: dict[str, Any]) -> None:
            await asyncio.sleep(0)
            self.got.append(data)

    receiver = Async("in")

    async with kit.running(kit.connector_of(Ticks("out")), kit.connector_of(receiver)) as scene:
        operator, _ = await scene.greeted()
        out = operator.open("out")
        operator.open("in").say({"a": 1})
        await kit.until(lambda: len(out.values()) > 3 and receiver.got == [{"a": 1}])


async def test_the_same_session_on_a_new_transport_replaces_the_old_one(kit: Any) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        await _our_server(kit, scene)
        first = await scene.network.offer("p1")
        control = await first.greet()
        second = await scene.network.offer("p2")
        peers = scene.robot._running.peers
        new = peers.get("p2")
        object.__setattr__(new.sender, "session_id", peers.get("p1").sender.session_id)
        second.listener.state_changed("connected")
        await kit.until(lambda: first.is_closed)
        assert control.heard("bye")[0].code == "peer.replaced"
        assert [peer.peer_id for peer in scene.robot.peers] == ["p2"]


async def test_an_operator_who_makes_the_robot_keep_too_much_is_sent_away_and_named(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    async with kit.running(kit.connector_of(Counter("count"))) as scene:
        operator, control = await scene.greeted()
        operator.listener.bound_exceeded("a message has no end")
        await kit.until(lambda: operator.is_closed)
        assert [(bye.code, bye.message) for bye in control.heard("bye")] == [
            ("channel.too_large", "a message has no end")
        ]
    assert "operator p1 (account unknown) is disconnected, it sent too much" in caplog.text


class Dozy(DataChannelSendable[str]):
    """Sleeps on the event loop, once."""

    async def messages(self) -> AsyncIterator[str]:
        time.sleep(0.7)  # noqa: ASYNC251 (the very mistake)
        yield "late"
        await asyncio.Event().wait()


async def test_who_holds_up_the_event_loop_is_told_to_plugins_and_shown(kit: Any) -> None:
    async with kit.running(kit.connector_of(Dozy("dozy"))) as scene:
        await kit.until(lambda: any(call["label"] == "dozy" for call in scene.hooks.of("blocked")))
        loop = scene.robot.snapshot().loop
        assert loop is not None
        assert loop.blocks["dozy"] == 1
        assert "test_robot.py" in loop.last_place or loop.last_label != "dozy"
