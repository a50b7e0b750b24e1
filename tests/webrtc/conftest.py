"""A robot's and an operator's side of real peer connections, joined in this process by function calls."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.contract.media import EncodingParams
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.media_transport import PictureFeed
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

WAIT_S = 30.0


class Side:
    """Records what one side is told."""

    def __init__(self) -> None:
        self.media = self
        self.congestion = PeerCongestion()
        self.other: Any = None
        self.states: asyncio.Queue[str] = asyncio.Queue()
        self.channels: asyncio.Queue[Channel] = asyncio.Queue()
        self.tracks: asyncio.Queue[tuple[str, Any]] = asyncio.Queue()
        self.origins: asyncio.Queue[tuple[str, int, int]] = asyncio.Queue()
        self.streams: dict[str, SharedVideo] = {}
        self.counters = ConnectorCounters()
        self.unbound: list[str] = []
        self.refused: dict[str, str] = {}
        self.refusals: list[tuple[str, str]] = []
        self.trickled: list[IceCandidate] = []
        self._tasks: set[asyncio.Task[None]] = set()

    def candidate_found(self, candidate: IceCandidate) -> None:
        self.trickled.append(candidate)
        task = asyncio.create_task(self.other.add_candidate(candidate))
        self._tasks.add(task)

    def bound_exceeded(self, why: str) -> None:
        raise AssertionError(why)

    is_local = True

    def state_changed(self, state: str) -> None:
        self.states.put_nowait(state)

    def channel_opened(self, channel: Channel) -> None:
        self.channels.put_nowait(channel)

    def track_bound(self, label: str) -> PictureFeed:
        """As the robot's hub does: its stream is shared with whoever else a test binds."""
        return self.stream(label).bind(str(id(self)), lambda code: self.refusals.append((label, code)))

    def stream(self, label: str) -> SharedVideo:
        if label not in self.streams:
            self.streams[label] = SharedVideo(label, EncodingParams(), self.counters)
        return self.streams[label]

    def watch(self, label: str, on: bool = True) -> SharedVideo:
        self.streams[label].watch(str(id(self)), on)
        return self.streams[label]

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        self.unbound.extend(labels)

    def track_refused(self, label: str, cause: str) -> None:
        self.refused[label] = cause

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        self.origins.put_nowait((label, ssrc, rtp_origin))

    def track_arrived(self, label: str, track: Any) -> None:
        self.tracks.put_nowait((label, track))

    async def reaches(self, state: str) -> None:
        async with asyncio.timeout(WAIT_S):
            while await self.states.get() != state:
                pass


class Pair:
    """An operator that offers and a robot that answers."""

    def __init__(self, ice_servers: Sequence[IceServer] = ()) -> None:
        self.robot_side, self.operator_side = Side(), Side()
        self.robot = AiortcAnswerer(self.robot_side, ice_servers)
        self.operator = AiortcOfferer(self.operator_side, ice_servers)
        self.robot_side.other, self.operator_side.other = self.operator, self.robot

    async def join(self, media_labels: Sequence[str] = (), *, with_tracks: bool = True) -> None:
        sdp, tracks = await self.operator.offer()
        answer = await self.robot.answer(sdp, media_labels, tracks if with_tracks else None)
        await self.operator.accept_answer(answer)
        await asyncio.gather(self.robot_side.reaches("connected"), self.operator_side.reaches("connected"))


@asynccontextmanager
async def joined_pair(ice_servers: Sequence[IceServer] = ()) -> AsyncIterator[Pair]:
    pair = Pair(ice_servers)
    try:
        yield pair
    finally:
        await asyncio.gather(pair.operator.close(), pair.robot.close())
        for stream in pair.robot_side.streams.values():
            stream.close()


@pytest.fixture
def pair() -> Any:
    """``async with pair() as p``: a robot's and an operator's peer connection, closed at the end."""
    return joined_pair


@pytest.fixture
def side() -> Any:
    """``side()``: what records what one of our sides is told, for a test that brings the other one."""
    return Side
