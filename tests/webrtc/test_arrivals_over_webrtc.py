"""A robot hears from a Python operator when each packet arrived, and what it may send follows from that."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import numpy as np
import pytest

from mosaic_core import Captured, EncodingParams
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.machines.congestion.feedback import Feedback
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.machines.congestion.rate_control import START_BPS
from mosaic_core.runtime.observation.counters import ConnectorCounters

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0


@pytest.mark.parametrize("takes_them", [True, False])
async def test_a_robot_adapts_to_a_python_operator_by_arrivals_if_both_know_how(pair: Any, takes_them: bool) -> None:
    stream = SharedVideo("front", EncodingParams(max_bitrate_bps=2_000_000), ConnectorCounters())
    heard: list[Feedback] = []
    async with pair() as peers:
        peers.robot_side.streams["front"] = stream
        feed: Any = peers.robot_side.track_bound("front")
        if not takes_them:
            offer = peers.operator.offer
            peers.operator.offer = lambda: without_reports(offer)
        peers.operator.add_video("front")
        await peers.join(["front"])
        handle = feed.connection.handle

        def noted(stream: object, feedback: Feedback) -> None:
            heard.append(feedback)
            handle(stream, feedback)

        feed.connection.handle = noted
        peers.robot_side.watch("front")
        _, track = await asyncio.wait_for(peers.operator_side.tracks.get(), WAIT_S)
        async with asyncio.timeout(WAIT_S):
            watching = asyncio.create_task(watch(track))
            while not is_enough(heard, feed, takes_them):
                stream.offer(Captured(noise(len(heard)), time.monotonic()))
                await asyncio.sleep(0.04)
            watching.cancel()
    seen = [one for one in heard if isinstance(one, PathSeen)]
    if takes_them:
        assert max(one.received for one in seen) > 1
    else:
        assert not seen


def is_enough(heard: list[Feedback], feed: Any, takes_them: bool) -> bool:
    return len(heard) >= 1 and (not takes_them or (len(heard) >= 10 and feed.budget_bps != START_BPS))


async def without_reports(offer: Any) -> Any:
    """As an operator of before, or a robot of somebody else's, would have it."""
    sdp, tracks = await offer()
    lines = sdp.splitlines(keepends=True)
    return "".join(line for line in lines if "transport-wide-cc" not in line and "transport-cc" not in line), tracks


async def watch(track: Any) -> None:
    while True:
        await track.next()


def noise(seed: int) -> Any:
    """Pictures of several packets."""
    return np.random.default_rng(seed).integers(0, 255, (48, 64, 3), np.uint8).repeat(10, 0).repeat(10, 1)
