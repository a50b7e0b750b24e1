"""Hands pictures or sound to their viewers as they are, the newest first: for what need not be adapted to a link."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from mosaic_core.contract.media import EncodingParams, PacketCodec
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.machines.congestion.feedback import Feedback
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.transport.media_transport import PicturePreparer, PictureStreamFactory, TellUnavailable
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion


class NewestFeed:
    """Keeps the newest items for one viewer, at most ``max_waiting``; a ``runtime.transport.PictureFeed``. A newer one
    replaces the oldest, so that latency never accumulates. Event loop only."""

    codec_order: tuple[str, ...] = ()

    def __init__(self, max_waiting: int = 1) -> None:
        self._waiting: deque[Any] = deque(maxlen=max_waiting)
        self._arrived = asyncio.Event()

    async def next(self) -> Any:
        while not self._waiting:
            self._arrived.clear()
            await self._arrived.wait()
        return self._waiting.popleft()

    def put(self, item: Any) -> bool:
        """Whether the oldest one had to go for it."""
        is_full = len(self._waiting) == self._waiting.maxlen
        self._waiting.append(item)
        self._arrived.set()
        return is_full

    def clear(self) -> None:
        """The viewer looks away: what waits is old by the time it looks again."""
        self._waiting.clear()

    def codec_agreed(self, mime_type: str) -> None:
        """There is no choice."""

    def send_over(self, connection: PeerCongestion) -> None:
        """It waits for nobody."""

    def shown(self, size_px: int | None, *, leads: bool) -> None:
        """It costs the same at any size."""

    def heard(self, feedback: Feedback) -> None:
        """Nothing to adapt."""

    def repeats(self, sequence_number: int) -> int:
        return 0

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        return False

    async def paced(self, size_bytes: int) -> None:
        """At once."""


class PlainStream:
    """Hands one camera's pictures to its viewers as they are; a ``runtime.transport.PictureStream``. ``prepare`` runs
    on the handler's thread, once per item.
    """

    def __init__(
        self,
        prepare: Callable[[Any], Any],
        counters: ConnectorCounters,
        make_feed: Callable[[], NewestFeed] = NewestFeed,
        max_handed_over: int = 256,
    ) -> None:
        self._prepare = prepare
        self._counters = counters
        self._make_feed = make_feed
        self._handover: Handover[Any] = Handover(asyncio.get_running_loop(), self._distribute, max_handed_over)
        self._feeds: dict[str, NewestFeed] = {}
        self._watching: dict[str, NewestFeed] = {}  # replaced, never changed: the handler's thread reads it

    def offer(self, item: Any) -> bool:
        return bool(self._watching) and self._handover.put(self._prepare(item))

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> NewestFeed:
        return self._feeds.setdefault(viewer_id, self._make_feed())

    def watch(self, viewer_id: str, on: bool) -> None:
        feed = self._feeds.get(viewer_id)
        if feed is None:
            return
        others = {name: other for name, other in self._watching.items() if name != viewer_id}
        self._watching = {**others, viewer_id: feed} if on else others
        if not on:
            feed.clear()

    def leave(self, viewer_id: str) -> None:
        self.watch(viewer_id, False)
        self._feeds.pop(viewer_id, None)

    def close(self) -> None:
        self._watching = {}

    def _distribute(self, item: Any) -> None:
        for feed in self._watching.values():
            self._counters.dropped += feed.put(item)
        self._counters.count(self._size_bytes(item), time.monotonic())

    def _size_bytes(self, item: Any) -> int:
        """What is not encoded has no size that means anything."""
        return 0


def plain_streams(prepare: PicturePreparer) -> PictureStreamFactory:
    """A factory of streams that only ``prepare`` pictures."""

    def open_stream(
        label: str,
        encoding: EncodingParams,
        counters: ConnectorCounters,
        packet_codec: PacketCodec | None = None,
    ) -> PlainStream:
        return PlainStream(prepare, counters)

    return open_stream


def plain_sound(label: str, encoding: SoundEncoding, counters: ConnectorCounters) -> PlainStream:
    """A ``SoundStreamFactory``: every listener gets the newest piece as it is."""
    return PlainStream(lambda sound: sound, counters)
