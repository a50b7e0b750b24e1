"""A camera that was not in the first offer is watched on the live connection."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import numpy as np
import pytest

from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import NUMBER_URI
from mosaic_core.adapters.peers import description_bounds
from mosaic_core.contract.media import Captured
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.errors import ConnectionFailed

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0


async def arrived(peers: Any, labels: set[str]) -> dict[str, Any]:
    """The videos that the operator has, once it has these."""
    videos: dict[str, Any] = {}
    async with asyncio.timeout(WAIT_S):
        while not labels <= set(videos):
            label, video = await peers.operator_side.tracks.get()
            videos[label] = video
    return videos


async def shows(peers: Any, label: str, video: Any, shade: int) -> None:
    """A picture of this shade comes through."""
    stream = peers.robot_side.watch(label)
    async with asyncio.timeout(WAIT_S):
        while True:
            stream.offer(Captured(np.full((120, 160, 3), shade, np.uint8), time.monotonic()))
            waiting = asyncio.create_task(video.next())
            done, _ = await asyncio.wait({waiting}, timeout=0.1)
            if not done:
                waiting.cancel()
                continue
            frame = waiting.result()
            if abs(int(frame.to_ndarray(format="bgr24").mean()) - shade) < 12:
                return


async def more(peers: Any, labels: list[str], known: list[str]) -> None:
    sdp, tracks = await peers.operator.offer_more(labels)
    await peers.operator.accept_answer(await peers.robot.answer(sdp, known, tracks))


async def test_a_line_is_added_while_another_one_and_the_data_go_on(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        channel = peers.operator.create_channel("echo", protocol=CHANNEL_PROTOCOL)
        await peers.join(["front"])
        front = (await arrived(peers, {"front"}))["front"]
        await shows(peers, "front", front, 60)
        await more(peers, ["rear"], ["front", "rear"])
        rear = (await arrived(peers, {"rear"}))["rear"]
        await shows(peers, "rear", rear, 200)
        await shows(peers, "front", front, 120)
        assert peers.robot_side.unbound == []
        robot_channel = await peers.robot_side.channels.get()
        got: asyncio.Queue[Any] = asyncio.Queue()
        robot_channel.on_message = got.put_nowait
        channel.send(b"still here")
        async with asyncio.timeout(WAIT_S):
            assert await got.get() == b"still here"


async def test_a_line_that_goes_on_keeps_what_aiortc_itself_would_not_agree_on_again(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.add_video("front")
        await peers.join(["front"])
        sdp, tracks = await peers.operator.offer_more(["rear"])
        answer = await peers.robot.answer(sdp, ["front", "rear"], tracks)
        numbered = [NUMBER_URI in line for line in answer.split("m=") if line.startswith("video")]
        assert numbered == [True, True]


async def test_the_first_line_of_all_may_come_later(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.create_channel("echo", protocol=CHANNEL_PROTOCOL)
        await peers.join([])
        await more(peers, ["front"], ["front"])
        await shows(peers, "front", (await arrived(peers, {"front"}))["front"], 90)
        await more(peers, ["rear"], ["front", "rear"])
        await shows(peers, "rear", (await arrived(peers, {"rear"}))["rear"], 150)


@pytest.mark.parametrize("change", ["another ICE user", "a line less", "no bundle", "too many lines"])
async def test_a_further_offer_can_only_add_lines(pair: Any, change: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if change == "too many lines":
        monkeypatch.setattr(description_bounds, "MAX_LINES", 2)

    async with pair() as peers:
        peers.operator.add_video("front")
        peers.operator.create_channel("echo", protocol=CHANNEL_PROTOCOL)
        await peers.join(["front"])
        sdp, tracks = await peers.operator.offer_more(["rear"])
        if change == "another ICE user":
            sdp = sdp.replace("a=ice-ufrag:", "a=ice-ufrag:x")
        elif change == "a line less":
            sdp = sdp[: sdp.index("m=video")] + sdp[sdp.index("m=application") :]
        elif change == "no bundle":
            sdp = sdp.replace("a=group:BUNDLE", "a=group:OTHER")
        with pytest.raises(ConnectionFailed) as refused:
            await peers.robot.answer(sdp, ["front", "rear"], tracks)
        assert refused.value.code == "sdp.invalid"
        front = (await arrived(peers, {"front"}))["front"]
        await shows(peers, "front", front, 60)
