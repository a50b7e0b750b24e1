"""The host of a handler in a running robot: real time, real waiting, and the way to the operators."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable

from mosaic_core.contract.host import Loss, Outgoing
from mosaic_core.contract.media import Picture
from mosaic_core.contract.media_tap import TapCodec
from mosaic_core.contract.sound import Sound
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.media_tap import RuntimeTap
from mosaic_core.runtime.media.picture_tap import RuntimePictureTap
from mosaic_core.runtime.observation.counters import HandlerLosses


class RuntimeHost:
    """Given to one handler. ``send*`` on any thread; ``wait_async`` on the event loop; ``wait`` on the body's."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        post: Callable[[Outgoing], bool],
        media: MediaHub,
        is_heard: Callable[[str], bool] = lambda channel: False,
    ) -> None:
        self.losses = HandlerLosses()
        """What the handler says that it left out."""
        self._loop = loop
        self._post = post
        self._media = media
        self._is_heard = is_heard
        self._stop = threading.Event()
        self._stop_async = asyncio.Event()

    def arm(self) -> None:
        """A new run of the body begins; never called while an older one still runs."""
        self._stop.clear()
        self._call_on_loop(self._settle)

    def stop(self) -> None:
        """End the body: wakes whatever waits. Any thread."""
        self._stop.set()
        self._call_on_loop(self._settle)

    def _settle(self) -> None:
        if self._stop.is_set():
            self._stop_async.set()
        else:
            self._stop_async.clear()

    def _call_on_loop(self, action: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(action)
        except RuntimeError:
            return  # the loop is closed; nobody waits on it any more

    def monotonic_s(self) -> float:
        return time.monotonic()

    @property
    def is_stopping(self) -> bool:
        return self._stop.is_set()

    def wait(self, seconds: float) -> bool:
        return self._stop.wait(seconds)

    async def wait_async(self, seconds: float) -> bool:
        if self._stop.is_set():
            return True
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._stop_async.wait(), seconds)
        return self._stop.is_set()

    async def stopped(self) -> None:
        """Waits until :meth:`stop`. Event loop."""
        while not self._stop.is_set():
            await self._stop_async.wait()
            await asyncio.sleep(0)

    def send(self, message: Outgoing) -> bool:
        return self._post(message)

    def is_heard(self, channel: str) -> bool:
        return self._is_heard(channel)

    def send_picture(self, label: str, picture: Picture) -> bool:
        return self._media.post(label, picture)

    def send_sound(self, label: str, sound: Sound) -> bool:
        return self._media.post_sound(label, sound)

    def count_loss(self, reason: Loss, messages: int) -> None:
        self.losses.add(reason, messages)

    def tap_media(self, label: str, codec: TapCodec) -> RuntimeTap:
        return RuntimeTap(self._loop, self._media, label, codec)

    def tap_pictures(self, label: str) -> RuntimePictureTap:
        return RuntimePictureTap(self._loop, self._media, label)
