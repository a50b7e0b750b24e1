"""What the runtime needs from the network for sound, as Protocols; ``adapters`` implement them.

Everything here is called on the event loop, but for :meth:`SoundStream.offer`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.picture_transport import PictureFeed, TellUnavailable

OPUS = "audio/opus"
"""The one codec of sound."""


@dataclass(frozen=True, slots=True)
class SoundLabels:
    """A robot's audio connectors in the order of its YAML file. Only lines that the operator names are given to them:
    an original dashboard's offer has none."""

    microphones: Sequence[str] = ()
    speakers: Sequence[str] = ()


NO_SOUND = SoundLabels()


@dataclass(frozen=True, slots=True)
class HeardSound:
    """A piece of a talker's voice: 48 kHz, two channels. ``position``: of its first sample on the talker's clock.

    ``is_silent``: nobody could hear it.
    """

    position: int
    sound: Sound
    is_silent: bool


class IncomingSound(Protocol):
    """The voice of one operator."""

    async def next(self) -> HeardSound | None:
        """The next piece, ``None`` at the end. Somebody must call it all the time, or sound piles up."""

    def stop(self) -> None: ...


class SoundStream(Protocol):
    """All sound of one microphone on its way to its listeners; a ``PictureStream`` but for what it carries."""

    def offer(self, item: Sound) -> bool:
        """Take a piece on its handler's thread. ``False`` if nobody listens or the loop is behind."""

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> PictureFeed: ...
    def watch(self, viewer_id: str, on: bool) -> None: ...
    def leave(self, viewer_id: str) -> None: ...
    def close(self) -> None: ...


class SoundStreamFactory(Protocol):
    """Makes the sound stream of a microphone, once, on the event loop."""

    def __call__(self, label: str, encoding: SoundEncoding, counters: ConnectorCounters) -> SoundStream: ...
