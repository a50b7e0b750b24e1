"""Declares what the runtime needs from the network for pictures and sound, as Protocols; ``adapters`` implement them.

Everything here is called on the event loop, but for :meth:`MediaStream.offer` and :class:`PicturePreparer`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, TypeVar

from mosaic_core.contract.media import Captured, EncodingParams, PacketCodec
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.machines.congestion.feedback import Feedback
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion

Item_contra = TypeVar("Item_contra", contravariant=True)
OPUS = "audio/opus"
"""The one codec of sound."""


class PictureFeed(Protocol):
    """Gives a track the pictures that it sends; one feed per (peer, label)."""

    @property
    def codec_order(self) -> Sequence[str]:
        """MIME types, the preferred one first; empty: the transport's own order."""

    def codec_agreed(self, mime_type: str) -> None:
        """What the peers will speak; told once, before :meth:`next`."""

    def send_over(self, connection: PeerCongestion) -> None:
        """Whose budget it shares; told once, before :meth:`next`. Without it nobody else sends beside it."""

    def shown(self, size_px: int | None, *, leads: bool) -> None:
        """How large the viewer shows it (width x height, ``None``: not told), and whether it drives by it."""

    async def next(self) -> Any:
        """The next picture of the agreed codec (``av.Packet`` with pts and time base); waits while there is none.
        Whoever takes them too slowly goes on at a later one: latency never accumulates."""

    def heard(self, feedback: Feedback) -> None:
        """What the operator's side reports about the link and its decoder."""

    def repeats(self, sequence_number: int) -> int:
        """How many times a packet that the operator's side misses is sent again now: 0, 1 or 2."""

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        """A packet of a picture has left: whether it is sent a second time unasked, because the link loses some."""

    async def paced(self, size_bytes: int) -> None:
        """A packet of a picture has left: wait until the next one may, so that a large picture is no burst."""


TellUnavailable: TypeAlias = Callable[[str], None]
"""Called with a ``media.*`` code when a viewer can't be sent any picture."""


class MediaStream(Protocol[Item_contra]):
    """All pictures of one camera, or all sound of one microphone, on its way to its viewers. Event loop, but for
    :meth:`offer`."""

    def offer(self, item: Item_contra, /) -> bool:
        """Take a piece on its handler's thread. ``False`` if nobody watches or the loop is behind."""

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> PictureFeed:
        """A viewer's feed, silent until :meth:`watch`. ``is_local``: on this robot, where no link limits it."""

    def watch(self, viewer_id: str, on: bool) -> None: ...
    def leave(self, viewer_id: str) -> None: ...

    def close(self) -> None:
        """Release what it holds; nothing is offered any more."""


PictureStream: TypeAlias = MediaStream[Captured]
SoundStream: TypeAlias = MediaStream[Sound]


class PictureStreamFactory(Protocol):
    """Makes the picture stream of a label, once, on the event loop. ``packet_codec`` is that of the packets that its
    handler says it yields.
    """

    def __call__(
        self,
        label: str,
        encoding: EncodingParams,
        counters: ConnectorCounters,
        packet_codec: PacketCodec | None = None,
    ) -> PictureStream: ...


PicturePreparer: TypeAlias = Callable[[Captured], Any]
"""Converts a handler's picture once, on the handler's thread, into what all viewers share."""


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


SoundStreamFactory: TypeAlias = Callable[[str, SoundEncoding, ConnectorCounters], SoundStream]
"""Makes the sound stream of a microphone, by its label, once, on the event loop."""
