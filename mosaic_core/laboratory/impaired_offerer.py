"""Puts a path in user space between an operator and its robots, at the operator's end: the robot needs no change and
may be another process.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mosaic_core.laboratory.detours import Detour, changed, detour
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.laboratory.natted_path import NattedPath
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.operator_transport import (
    IncomingVideo,
    Offerer,
    OffererFactory,
    OffererListener,
    OutgoingSound,
)
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


def impaired_operator(make_offerer: OffererFactory, path: ImpairedPath) -> OffererFactory:
    """``make_offerer``, behind ``path``: give it to a :class:`~mosaic_core.operator.MosaicOperator`.

    A robot behind a :class:`NattedPath` must be told the ICE servers of :func:`robot_ice_servers`.
    """

    def make(listener: OffererListener, ice_servers: Sequence[IceServer]) -> Offerer:
        way = detour(path)
        # The ICE servers of the real world would lead around the path.
        own = (IceServer(urls=(path.ice_url(path.operator),)),) if isinstance(path, NattedPath) else ()
        return _ImpairedOfferer(make_offerer(_Listener(listener, way), own), way)

    return make


def robot_ice_servers(path: ImpairedPath) -> tuple[IceServer, ...]:
    """What a robot is told to ask for its public address, and for a relay."""
    return (IceServer(urls=(path.ice_url(path.robot),)),) if isinstance(path, NattedPath) else ()


class _ImpairedOfferer:
    """An ``Offerer`` whose candidates, and the robot's, lead through the path."""

    def __init__(self, offerer: Offerer, way: Detour) -> None:
        self._offerer = offerer
        self._way = way

    def create_channel(
        self, label: str, *, protocol: str = "", ordered: bool = True, max_retransmits: int | None = None
    ) -> Channel:
        return self._offerer.create_channel(label, protocol=protocol, ordered=ordered, max_retransmits=max_retransmits)

    def add_video(self, label: str) -> None:
        self._offerer.add_video(label)

    def add_microphone(self, label: str) -> None:
        self._offerer.add_microphone(label)

    def add_speaker(self, label: str) -> OutgoingSound:
        return self._offerer.add_speaker(label)

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        sdp, tracks = await self._offerer.offer()
        return self._way.offer(sdp), tracks

    async def offer_more(self, pictures: Sequence[str]) -> tuple[str, Mapping[str, str]]:
        sdp, tracks = await self._offerer.offer_more(pictures)
        return self._way.offer(sdp), tracks

    async def accept_answer(self, sdp: str) -> None:
        await self._offerer.accept_answer(changed(sdp, self._way.of_robot))

    async def add_candidate(self, candidate: IceCandidate) -> None:
        told = _told(candidate, self._way.of_robot(candidate.candidate))
        if told is not None:
            await self._offerer.add_candidate(told)

    def path(self) -> ChosenPath | None:
        return self._offerer.path()

    async def close(self) -> None:
        await self._offerer.close()


class _Listener:
    """An ``OffererListener`` that passes everything on, candidates as the robot may know them."""

    def __init__(self, listener: OffererListener, way: Detour) -> None:
        self._listener = listener
        self._way = way

    def candidate_found(self, candidate: IceCandidate) -> None:
        told = _told(candidate, self._way.of_operator(candidate.candidate))
        if told is not None:
            self._listener.candidate_found(told)

    def state_changed(self, state: str) -> None:
        self._listener.state_changed(state)

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        self._listener.track_arrived(label, video)


def _told(candidate: IceCandidate, text: str | None) -> IceCandidate | None:
    """An empty candidate says that there are no more."""
    if not candidate.candidate:
        return candidate
    return None if text is None else candidate.model_copy(update={"candidate": text})
