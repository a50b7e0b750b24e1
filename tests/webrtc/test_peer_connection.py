"""aiortc's answerer and offerer against each other, on this machine's own addresses."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import numpy as np
import pytest

from mosaic_core.adapters.video.picture_clock import pts_of
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.contract.media import Captured
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
DEAD = IceServer(urls=("stun:192.0.2.250:9",))  # TEST-NET-1 (RFC 5737): nobody lives there


async def opened(channel: Any) -> Any:
    if not channel.is_open:
        is_open = asyncio.Event()
        channel.on_open = is_open.set
        async with asyncio.timeout(WAIT_S):
            await is_open.wait()
    return channel


async def next_of(queue: asyncio.Queue[Any]) -> Any:
    async with asyncio.timeout(WAIT_S):
        return await queue.get()


async def encoded(stream: SharedVideo, pictures: int) -> None:
    """So many pictures have been encoded: the next one will not replace one that waits."""
    async with asyncio.timeout(WAIT_S):
        while stream.encoders.encoded < pictures:  # noqa: ASYNC110 - it happens on the encoder's thread
            await asyncio.sleep(0.002)


def scene(step: int) -> np.ndarray[Any, Any]:
    """A gradient with a bright square that moves: easy to tell from its neighbours after lossy coding."""
    image = np.zeros((240, 320, 3), np.uint8)
    image[:, :, 0] = np.linspace(0, 160, 320, dtype=np.uint8)
    image[60:120, 20 + 40 * step : 80 + 40 * step] = (40, 220, 240)
    return image


async def test_channels_carry_text_and_bytes_both_ways_with_their_protocol_and_reliability(pair: Any) -> None:
    async with pair() as peers:
        framed = peers.operator.create_channel("pose", protocol=CHANNEL_PROTOCOL, ordered=False, max_retransmits=0)
        plain = peers.operator.create_channel("battery")
        await peers.join()
        robot_channels = {}
        for _ in range(2):
            channel = await next_of(peers.robot_side.channels)
            robot_channels[channel.label] = channel
        assert robot_channels["pose"].protocol == "mosaic.1"
        assert not robot_channels["pose"].is_reliable
        assert robot_channels["battery"].protocol == ""
        assert robot_channels["battery"].is_reliable
        to_robot: asyncio.Queue[Any] = asyncio.Queue()
        to_operator: asyncio.Queue[Any] = asyncio.Queue()
        robot_channels["pose"].on_message = to_robot.put_nowait
        plain.on_message = to_operator.put_nowait
        (await opened(framed)).send(b"\x01\x02")
        robot_channels["battery"].send('{"percent": 80}')
        assert await next_of(to_robot) == b"\x01\x02"
        assert await next_of(to_operator) == '{"percent": 80}'


async def test_a_channel_made_after_the_connection_needs_no_new_offer(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.create_channel("first")
        await peers.join()
        late = peers.operator.create_channel("late", protocol=CHANNEL_PROTOCOL)
        await opened(late)
        labels = {(await next_of(peers.robot_side.channels)).label for _ in range(2)}
        assert labels == {"first", "late"}


async def test_a_closed_channel_says_so_once_and_refuses_to_send(pair: Any) -> None:
    async with pair() as peers:
        mine = peers.operator.create_channel("x")
        await peers.join()
        theirs = await next_of(peers.robot_side.channels)
        await opened(mine)
        closings: asyncio.Queue[str] = asyncio.Queue()
        theirs.on_close = lambda: closings.put_nowait("closed")
        mine.close()
        mine.close()
        assert await next_of(closings) == "closed"
        with pytest.raises(ConnectionFailed) as refused:
            theirs.send("too late")
        assert refused.value.code == "peer.closed"
        theirs.close()
        assert closings.empty()


async def test_a_full_queue_is_seen_and_its_draining_is_told(pair: Any) -> None:
    async with pair() as peers:
        mine = peers.operator.create_channel("bulk")
        other = peers.operator.create_channel("other")
        await peers.join()
        await opened(mine)
        drained = asyncio.Event()

        def on_drained() -> None:
            if other.buffered_bytes == 0:
                drained.set()

        other.on_drained = on_drained
        for _ in range(20):
            mine.send(bytes(60_000))
        assert other.buffered_bytes > 1_000_000  # the whole peer connection's queue
        async with asyncio.timeout(WAIT_S):
            await drained.wait()


async def test_a_message_larger_than_the_other_side_takes_is_refused_with_a_code(pair: Any) -> None:
    async with pair() as peers:
        mine = peers.operator.create_channel("x")
        await peers.join()
        await opened(mine)
        with pytest.raises(ConnectionFailed) as refused:
            mine.send(bytes(300_000))
        assert refused.value.code == "channel.too_large"


async def test_pictures_arrive_under_their_label_with_their_content(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("rear")
        peers.operator.add_video("front")
        peers.operator.create_channel("_mosaic")
        with pytest.raises(ConnectionFailed):
            peers.operator.add_video("too_late")
        await peers.join(["front", "rear"])
        tracks = dict([await next_of(peers.operator_side.tracks) for _ in range(2)])
        assert set(tracks) == {"front", "rear"}
        captured_at_s = 1000.0
        stream = peers.robot_side.watch("front")
        stream.offer(Captured(scene(0), captured_at_s))
        for step in range(4):  # aiortc's receiver hands a frame out when the next one begins
            await encoded(stream, step + 1)
            stream.offer(Captured(scene(step + 1), captured_at_s + (step + 1) / 30))
            async with asyncio.timeout(WAIT_S):
                frame = await tracks["front"].next()
            shown = frame.to_ndarray(format="bgr24").astype(int)
            errors = [np.abs(shown - scene(other)).mean() for other in range(5)]
            assert int(np.argmin(errors)) == step
            assert errors[step] < 12


async def test_the_rtp_origin_maps_every_picture_to_its_capture_time(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        await peers.join(["front"])
        _, track = await next_of(peers.operator_side.tracks)
        stream = peers.robot_side.watch("front")
        received = []
        stream.offer(Captured(scene(0), 5000.0))
        for step in range(1, 4):
            await encoded(stream, step)
            stream.offer(Captured(scene(step), 5000.0 + step * 0.0333))
            async with asyncio.timeout(WAIT_S):
                received.append((await track.next()).pts)
        label, _ssrc, origin = await next_of(peers.robot_side.origins)
        assert label == "front"
        assert 0 <= origin < 1 << 32
        expected = [pts_of(5000.0 + step * 0.0333) for step in range(3)]
        assert [pts - received[0] for pts in received] == [pts - expected[0] for pts in expected]
        assert peers.robot_side.origins.empty()


async def test_surplus_cameras_are_reported_and_lines_that_nobody_fills_stay_inactive(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        peers.operator.add_video("no_such_camera")
        sdp, tracks = await peers.operator.offer()
        answer = await peers.robot.answer(sdp, ["rear", "front", "top"], tracks)
        await peers.operator.accept_answer(answer)
        assert peers.robot_side.unbound == ["rear", "top"]
        assert set(peers.robot_side.streams) == {"front"}
        assert answer.count("a=inactive") == 1
        assert "a=msid:front front" in answer
        assert answer.index("VP8/90000") < answer.index("H264/90000")


async def test_an_operator_that_names_no_tracks_gets_them_in_the_order_of_the_file(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("video_a")
        sdp, _ = await peers.operator.offer()
        await peers.robot.answer(sdp, ["first", "second"], None)
        assert set(peers.robot_side.streams) == {"first"}
        assert peers.robot_side.unbound == ["second"]


async def test_an_offer_without_a_common_codec_is_refused_with_a_code(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        sdp, tracks = await peers.operator.offer()
        for name in ("VP8", "H264"):
            sdp = sdp.replace(f"{name}/90000", "AV1/90000")
        with pytest.raises(ConnectionFailed) as refused:
            await peers.robot.answer(sdp, ["front"], tracks)
        assert refused.value.code == "sdp.no_common_codec"
        assert "AV1" in refused.value.message


@pytest.mark.parametrize("offer", ["", "hello", "v=0\r\nm=video", "v=0\r\no=- 1 1 IN IP4 0.0.0.0\r\ns=-\r\nt=0 0\r\n"])
async def test_an_offer_that_makes_no_sense_is_refused_with_a_code(pair: Any, offer: str) -> None:
    async with pair() as peers:
        with pytest.raises(ConnectionFailed) as refused:
            await peers.robot.answer(offer, [], None)
        assert refused.value.code == "sdp.invalid"


async def test_dead_stun_and_turn_servers_cost_nothing(pair: Any) -> None:
    turn = IceServer(urls=("turn:192.0.2.251:9", "turn:192.0.2.252:9?transport=tcp"), username="u", credential="c")

    async with pair([DEAD, turn]) as peers:
        peers.operator.create_channel("x")
        started_s = time.monotonic()
        await peers.join()
        took_s = time.monotonic() - started_s
        assert took_s < 2.5, took_s


async def test_the_end_of_one_side_is_told_to_the_other(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.create_channel("x")
        await peers.join()
        await peers.operator.close()
        await peers.operator.close()
        await peers.robot_side.reaches("closed")


async def test_a_candidate_before_the_offer_or_in_bad_shape_disturbs_nothing(pair: Any) -> None:
    from mosaic_core.words.signaling import IceCandidate

    async with pair() as peers:
        peers.operator.create_channel("x")
        bad = ("", "candidate:", "candidate:1 1 udp x y z typ host", "candidate:1 1 udp 1 no.such.host 9 typ host")
        for text in bad:
            await peers.robot.add_candidate(IceCandidate(candidate=text, sdp_mid="0"))
        await peers.join()
