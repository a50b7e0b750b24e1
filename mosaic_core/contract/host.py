"""Declares what the framework gives a handler: time, waiting, and a way out. Plugin authors see it through the handler.

The runtime implements :class:`HandlerHost` for real robots, the kit in ``mosaic_core.testing`` with a fake clock.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

from mosaic_core.contract.sender import Sender as Sender
from mosaic_core.machines.delivery.framing import PayloadKind

if TYPE_CHECKING:
    from mosaic_core.contract.data_tap import DataTap
    from mosaic_core.contract.media import Picture
    from mosaic_core.contract.media_tap import MediaTap, PictureTap, TapCodec
    from mosaic_core.contract.sound import Sound


Loss: TypeAlias = Literal["replaced", "dropped", "too_large", "thinned", "refused", "lost"]
"""Why a message did not arrive; each has a counter per connector (``runtime.observation.counters``)."""


@dataclass(frozen=True, slots=True)
class Outgoing:
    """A message on its way out. ``channel`` is the data channel's label, ``to`` a peer id or ``None`` for all.

    ``followers``: more payloads that travel right behind the first, each a message of its own to whoever receives
    them; here they are queued, replaced and counted as one. ``original_text`` makes what original operators get
    instead, on the event loop, if there are any.
    """

    channel: str
    kind: PayloadKind
    payload: bytes
    stamp_us: int
    to: str | None = None
    followers: tuple[bytes, ...] = ()
    original_text: Callable[[], str] | None = None

    @property
    def size_bytes(self) -> int:
        """Of all its payloads."""
        return len(self.payload) + sum(map(len, self.followers))


class HandlerHost(Protocol):
    """Gives a handler time, waiting and a way out. Every method may be called from any thread and never blocks, but for
    :meth:`wait`.
    """

    def monotonic_s(self) -> float:
        """Seconds of the robot's monotonic clock."""

    def wait(self, seconds: float) -> bool:
        """Block this thread for ``seconds`` or until stop; ``True`` when the handler shall stop."""

    def wait_async(self, seconds: float) -> Awaitable[bool]:
        """The same for ``async`` bodies."""

    @property
    def is_stopping(self) -> bool:
        """Whether the handler shall stop."""

    def send(self, message: Outgoing) -> bool:
        """Hand a message over; ``False`` if nobody listens or the queue is full."""

    def is_heard(self, channel: str) -> bool:
        """Whether anybody has the data channel open now."""

    def offer(self, label: str, item: Picture | Sound) -> bool:
        """Hand a picture or a piece of sound over; a newer picture replaces one that still waits. ``False`` if nobody
        watches or listens, or the event loop is behind."""

    def count_loss(self, reason: Loss, messages: int) -> None:
        """Count messages that the handler itself had to leave out, as the framework counts those that it leaves out."""

    def tap_media(self, label: str, codec: TapCodec) -> MediaTap:
        """The encoded pictures of another connector; nothing flows until the tap is entered."""

    def tap_pictures(self, label: str) -> PictureTap:
        """The pictures of another connector as they were captured; nothing flows until the tap is entered."""

    def tap_data(self, labels: Sequence[str]) -> DataTap:
        """What these connectors send and are told, or all but this one's; nothing flows until the tap is entered."""


class UnboundHost:
    """The host of a handler that no runtime has taken yet: time passes, nothing is sent."""

    is_stopping = False

    def monotonic_s(self) -> float:
        return time.monotonic()

    def wait(self, seconds: float) -> bool:
        time.sleep(seconds)
        return False

    async def wait_async(self, seconds: float) -> bool:
        import asyncio

        await asyncio.sleep(seconds)
        return False

    def send(self, message: Outgoing) -> bool:
        return False

    def is_heard(self, channel: str) -> bool:
        return False

    def offer(self, label: str, item: Any) -> bool:
        return False

    def count_loss(self, reason: Loss, messages: int) -> None:
        """Nobody looks."""

    def tap_media(self, label: str, codec: TapCodec) -> MediaTap:
        raise RuntimeError("nothing can be tapped before the robot runs")

    def tap_pictures(self, label: str) -> PictureTap:
        raise RuntimeError("nothing can be tapped before the robot runs")

    def tap_data(self, labels: Sequence[str]) -> DataTap:
        raise RuntimeError("nothing can be tapped before the robot runs")
