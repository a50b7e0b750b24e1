"""The host of a handler in a running robot: real time, real waiting, and the way to the operators."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import threading
import time
from collections.abc import Iterator, Sequence

from mosaic_core.contract.declared.code_lines import line_in
from mosaic_core.contract.host import Loss
from mosaic_core.contract.media_tap import TapCodec
from mosaic_core.runtime.delivery.data_tap import RuntimeDataTap
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.media_tap import RuntimePictureTap, RuntimeTap
from mosaic_core.runtime.observation.counters import HandlerLosses
from mosaic_core.runtime.threads.handover import on_loop
from mosaic_core.runtime.threads.stacks import caller_of_core
from mosaic_core.words.errors import MosaicError


def _would_block() -> MosaicError:
    place = line_in(caller_of_core(sys._getframe(1)))
    message = f"Waiting on the event loop's thread would stop the whole robot{f' ({place})' if place else ''}."
    cure = "Make it an `async def` that uses `async for` or `await`, or the body a `def`, which has its own thread."
    return MosaicError(f"{message} {cure}", code="plugin.blocks_loop", cure=cure)


class RuntimeHost:
    """Gives one handler time, waiting and the way out. ``send`` and ``offer`` on any thread, ``wait`` on the body's,
    ``wait_async`` on the event loop."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, outbox: Outbox, media: MediaHub, own_labels: Sequence[str] = ()
    ) -> None:
        """``own_labels``: the handler's, and those of the handlers beside it in its connector."""
        self.losses = HandlerLosses()
        """What the handler says that it left out."""
        self._loop = loop
        self._loop_thread = threading.get_ident()
        self._media = media
        self._outbox = outbox
        self._own_labels = own_labels
        self.send, self.is_heard, self.offer = outbox.post, outbox.is_heard, media.offer
        self.rests = False
        """The body waits here, as long as it wants."""
        self.rested_at_s = 0.0
        """When it went on after the last time."""
        self._stop = threading.Event()
        self._stop_async = asyncio.Event()

    def arm(self) -> None:
        """A new run of the body begins; never called while an older one still runs."""
        self._stop.clear()
        on_loop(self._loop, self._settle)

    def stop(self) -> None:
        """End the body: wakes whatever waits. Any thread."""
        self._stop.set()
        on_loop(self._loop, self._settle)

    def _settle(self) -> None:
        if self._stop.is_set():
            self._stop_async.set()
        else:
            self._stop_async.clear()

    def monotonic_s(self) -> float:
        return time.monotonic()

    @property
    def is_stopping(self) -> bool:
        return self._stop.is_set()

    def wait(self, seconds: float) -> bool:
        """Raises :class:`MosaicError` (``plugin.blocks_loop``) on the event loop's thread, which is everybody's."""
        if threading.get_ident() == self._loop_thread:
            raise _would_block()
        with self._resting():
            return self._stop.wait(seconds)

    async def wait_async(self, seconds: float) -> bool:
        if self._stop.is_set():
            return True
        with contextlib.suppress(TimeoutError), self._resting():
            await asyncio.wait_for(self._stop_async.wait(), seconds)
        return self._stop.is_set()

    @contextlib.contextmanager
    def _resting(self) -> Iterator[None]:
        self.rests = True
        try:
            yield
        finally:
            self.rested_at_s, self.rests = time.monotonic(), False

    async def stopped(self) -> None:
        """Waits until :meth:`stop`. Event loop."""
        while not self._stop.is_set():
            await self._stop_async.wait()
            await asyncio.sleep(0)

    def count_loss(self, reason: Loss, messages: int) -> None:
        self.losses.add(reason, messages)

    def tap_media(self, label: str, codec: TapCodec) -> RuntimeTap:
        return RuntimeTap(self._loop, self._media, label, codec)

    def tap_pictures(self, label: str) -> RuntimePictureTap:
        return RuntimePictureTap(self._loop, self._media, label)

    def tap_data(self, labels: Sequence[str]) -> RuntimeDataTap:
        others = [label for label in self._outbox.taps.channels if label not in self._own_labels]
        return RuntimeDataTap(self._loop, self._outbox, labels or others)
