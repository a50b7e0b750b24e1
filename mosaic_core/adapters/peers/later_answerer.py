"""Answers operators over aiortc, which is loaded when the first one comes.

aiortc and the codecs behind it take 20 to 30 MB, which a robot that nobody looks at need not hold. One with a camera or
sound loads codecs anyway, and is better served by ``AiortcAnswerer`` from the start: its first operator need not wait.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from mosaic_core.adapters.machine.event_loop import keep_what_is_loaded
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.media_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


class LaterAnswererFactory:
    """An ``AnswererFactory`` that calls ``load`` for the real one, on a thread, when the first offer comes: the event
    loop goes on meanwhile."""

    def __init__(self, load: Callable[[], AnswererFactory]) -> None:
        self._load = load
        self._make: AnswererFactory | None = None

    def __call__(self, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> Answerer:
        make = self._make
        return LaterAnswerer(self, listener, ice_servers) if make is None else make(listener, ice_servers)

    async def loaded(self) -> AnswererFactory:
        """The real one. Two operators at once both wait for the same modules."""
        if self._make is None:
            self._make = await asyncio.to_thread(self._load)
            keep_what_is_loaded()
        return self._make


class LaterAnswerer:
    """Answers an operator who came before aiortc was loaded, when it is; a ``runtime.transport.Answerer``."""

    def __init__(
        self, factory: LaterAnswererFactory, listener: AnswererListener, ice_servers: Sequence[IceServer]
    ) -> None:
        self._factory = factory
        self._listener = listener
        self._ice_servers = ice_servers
        self._answerer: Answerer | None = None
        self._early: list[IceCandidate] = []
        self._is_closed = False

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        if self._answerer is None:
            make = await self._factory.loaded()
            if self._is_closed:
                raise ConnectionFailed("This peer connection is closed.", code="sdp.invalid")
            self._answerer = make(self._listener, self._ice_servers)
            for candidate in self._early:
                await self._answerer.add_candidate(candidate)
        return await self._answerer.answer(offer_sdp, media_labels, tracks, sound)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        if self._answerer is None:
            self._early.append(candidate)
        else:
            await self._answerer.add_candidate(candidate)

    def path(self) -> ChosenPath | None:
        return None if self._answerer is None else self._answerer.path()

    async def close(self) -> None:
        self._is_closed = True
        if self._answerer is not None:
            await self._answerer.close()


def load_aiortc(*, relay_only: bool = False) -> AnswererFactory:
    """Import aiortc, which takes a few hundred milliseconds; any thread."""
    from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer

    return partial(AiortcAnswerer, relay_only=relay_only)
