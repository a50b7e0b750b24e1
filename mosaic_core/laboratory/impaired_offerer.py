"""Puts a path in user space between an operator and its robots, at the operator's end: the robot needs no change and
may be another process.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

from mosaic_core.laboratory.detours import Detour, PassingOn, changed, changed_candidate, detour, detoured
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.laboratory.natted_path import NattedPath
from mosaic_core.runtime.transport.operator_transport import Offerer, OffererFactory, OffererListener
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
        return cast("Offerer", _ImpairedOfferer(make_offerer(detoured(listener, way.of_operator), own), way))

    return make


def robot_ice_servers(path: ImpairedPath) -> tuple[IceServer, ...]:
    """What a robot is told to ask for its public address, and for a relay."""
    return (IceServer(urls=(path.ice_url(path.robot),)),) if isinstance(path, NattedPath) else ()


class _ImpairedOfferer(PassingOn):
    """An ``Offerer`` whose candidates, and the robot's, lead through the path."""

    def __init__(self, offerer: Offerer, way: Detour) -> None:
        super().__init__(offerer)
        self._way = way

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        sdp, tracks = await self._inner.offer()
        return self._way.offer(sdp), tracks

    async def offer_more(self, pictures: Sequence[str]) -> tuple[str, Mapping[str, str]]:
        sdp, tracks = await self._inner.offer_more(pictures)
        return self._way.offer(sdp), tracks

    async def accept_answer(self, sdp: str) -> None:
        await self._inner.accept_answer(changed(sdp, self._way.of_robot))

    async def add_candidate(self, candidate: IceCandidate) -> None:
        told = changed_candidate(candidate, self._way.of_robot)
        if told is not None:
            await self._inner.add_candidate(told)
