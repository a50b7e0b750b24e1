"""Puts an impaired path in front of a robot: operators learn the relay's addresses instead of the robot's, and the
robot learns none of theirs, so that every packet of both directions passes the relay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

from mosaic_core.laboratory.detours import PassingOn, PathDetour, changed, detoured
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.runtime.transport.media_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


def impaired(make_answerer: AnswererFactory, path: ImpairedPath) -> AnswererFactory:
    """``make_answerer``, behind ``path``: give it to a :class:`~mosaic_core.runtime.robot.Robot`."""

    def make(listener: AnswererListener, ice_servers: Sequence[IceServer]) -> Answerer:
        way = PathDetour(path)
        # Without ICE servers: a reflexive or relayed candidate would lead around the path.
        return cast("Answerer", _ImpairedAnswerer(make_answerer(detoured(listener, way.of_robot), ()), way))

    return make


class _ImpairedAnswerer(PassingOn):
    """An ``Answerer`` whose robot hears of no operator's address: it meets them at the relay."""

    def __init__(self, answerer: Answerer, way: PathDetour) -> None:
        super().__init__(answerer)
        self._way = way

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        answer = await self._inner.answer(self._way.offer(offer_sdp), media_labels, tracks, sound)
        return changed(answer, self._way.of_robot)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """Dropped."""
