"""Puts an impaired path in front of a robot: operators learn the relay's addresses instead of the robot's, and the
robot learns none of theirs, so that every packet of both directions passes the relay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mosaic_core.laboratory.detours import PathDetour, changed
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.media_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener, Channel
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


def impaired(make_answerer: AnswererFactory, path: ImpairedPath) -> AnswererFactory:
    """``make_answerer``, behind ``path``: give it to a :class:`~mosaic_core.runtime.robot.Robot`."""

    def make(listener: AnswererListener, ice_servers: Sequence[IceServer]) -> Answerer:
        way = PathDetour(path)
        # Without ICE servers: a reflexive or relayed candidate would lead around the path.
        return _ImpairedAnswerer(make_answerer(_RelayedListener(listener, way), ()), way)

    return make


class _ImpairedAnswerer:
    """An ``Answerer`` whose robot hears of no operator's address: it meets them at the relay."""

    def __init__(self, answerer: Answerer, way: PathDetour) -> None:
        self._answerer = answerer
        self._way = way

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        answer = await self._answerer.answer(self._way.offer(offer_sdp), media_labels, tracks, sound)
        return changed(answer, self._way.of_robot)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """Dropped."""

    def path(self) -> ChosenPath | None:
        return self._answerer.path()

    async def close(self) -> None:
        await self._answerer.close()


class _RelayedListener:
    """An ``AnswererListener`` that passes everything on, candidates with the relay's address."""

    def __init__(self, listener: AnswererListener, way: PathDetour) -> None:
        self.media = listener.media
        self._listener = listener
        self._way = way

    def candidate_found(self, candidate: IceCandidate) -> None:
        relayed = self._way.of_robot(candidate.candidate) if candidate.candidate else candidate.candidate
        if relayed is not None:
            self._listener.candidate_found(candidate.model_copy(update={"candidate": relayed}))

    def channel_opened(self, channel: Channel) -> None:
        self._listener.channel_opened(channel)

    def state_changed(self, state: str) -> None:
        self._listener.state_changed(state)
