"""Pictures to their viewers as they are, the newest one for each: for transports that carry pictures, not packets."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from mosaic_core.contract.media import EncodingParams, PacketCodec
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.machines.congestion.rate_control import Feedback
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.transport.picture_transport import PicturePreparer, PictureStreamFactory, TellUnavailable


class NewestFeed:
    """Where one viewer takes its pictures from: a newer one replaces one that waits. Event loop only."""

    codec_order: tuple[str, ...] = ()

    def __init__(self) -> None:
        self._waiting: Any = None
        self._arrived = asyncio.Event()
        self.dropped = 0

    async def next(self) -> Any:
        await self._arrived.wait()
        self._arrived.clear()
        picture, self._waiting = self._waiting, None
        return picture

    def put(self, picture: Any) -> None:
        self.dropped += self._arrived.is_set()
        self._waiting = picture
        self._arrived.set()

    def clear(self) -> None:
        """The viewer looks away: what waits is old by the time it looks again."""
        self._waiting = None
        self._arrived.clear()

    def codec_agreed(self, mime_type: str) -> None:
        """Nothing is encoded."""

    def heard(self, feedback: Feedback) -> None:
        """Nothing to adapt."""

    def repeats(self, sequence_number: int) -> int:
        return 1

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        return False

    def pause_s(self, size_bytes: int) -> float:
        return 0.0


class PlainStream:
    """Implements ``runtime.transport.PictureStream``: ``prepare`` runs on the handler's thread, once per picture."""

    def __init__(self, prepare: Callable[[Any], Any], counters: ConnectorCounters) -> None:
        self._prepare = prepare
        self._counters = counters
        self._handover: Handover[Any] = Handover(asyncio.get_running_loop(), self._distribute, max_items=256)
        self._feeds: dict[str, NewestFeed] = {}
        self._watching: frozenset[str] = frozenset()

    def offer(self, item: Any) -> bool:
        return bool(self._watching) and self._handover.put(self._prepare(item))

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> NewestFeed:
        return self._feeds.setdefault(viewer_id, NewestFeed())

    def watch(self, viewer_id: str, on: bool) -> None:
        self._watching = self._watching | {viewer_id} if on else self._watching - {viewer_id}
        if not on and viewer_id in self._feeds:
            self._feeds[viewer_id].clear()

    def leave(self, viewer_id: str) -> None:
        self.watch(viewer_id, False)
        self._feeds.pop(viewer_id, None)

    def close(self) -> None:
        """Nothing is held."""

    def _distribute(self, prepared: Any) -> None:
        for viewer_id in self._watching & self._feeds.keys():
            feed = self._feeds[viewer_id]
            before = feed.dropped
            feed.put(prepared)
            self._counters.dropped += feed.dropped - before
        self._counters.count(0, time.monotonic())


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
