"""One microphone for all its listeners: resampled and encoded once, the packets handed to everybody; whoever takes them
too slowly loses the oldest, so that latency never accumulates.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import Any

import av

from mosaic_core.adapters.sound.opus import OPUS
from mosaic_core.adapters.sound.sound_encoder import SoundEncoder
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.machines.congestion.rate_control import Feedback
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.transport.picture_transport import TellUnavailable

MAX_WAITING = 10
"""Packets of 20 ms that wait for one listener's transport."""
_MAX_HANDED_OVER = 50
"""One second on its way to the event loop."""


class SoundFeed:
    """Implements ``runtime.transport.PictureFeed`` for one listener. Event loop only."""

    codec_order = (OPUS,)

    def __init__(self) -> None:
        self._items: deque[av.Packet[Any]] = deque()
        self._arrived = asyncio.Event()

    async def next(self) -> av.Packet[Any]:
        while not self._items:
            self._arrived.clear()
            await self._arrived.wait()
        return self._items.popleft()

    def put(self, packet: av.Packet[Any]) -> bool:
        """Whether the oldest one had to go for it."""
        is_full = len(self._items) >= MAX_WAITING
        if is_full:
            self._items.popleft()
        self._items.append(packet)
        self._arrived.set()
        return is_full

    def clear(self) -> None:
        self._items.clear()

    def codec_agreed(self, mime_type: str) -> None:
        """There is one codec."""

    def heard(self, feedback: Feedback) -> None:
        """Sound takes little: nothing to adapt."""

    def repeats(self, sequence_number: int) -> int:
        return 0  # Opus repairs a loss from the next packet; a repeat comes too late

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        return False

    def pause_s(self, size_bytes: int) -> float:
        return 0.0


class SharedSound:
    """Implements ``runtime.sound_transport.SoundStream``."""

    def __init__(self, label: str, encoding: SoundEncoding, counters: ConnectorCounters) -> None:
        self._counters = counters
        self._encoder = SoundEncoder(encoding.bitrate_bps)
        self._handover: Handover[av.Packet[Any]] = Handover(
            asyncio.get_running_loop(), self._distribute, _MAX_HANDED_OVER
        )
        self._feeds: dict[str, SoundFeed] = {}
        self._listening: dict[str, SoundFeed] = {}  # replaced, never changed: the handler's thread reads it

    def offer(self, sound: Sound) -> bool:
        """See ``SoundStream``. Raises :class:`TypeError` or :class:`ValueError` for what is no sound."""
        if not self._listening:
            self._encoder.rest()
            return False
        is_taken = True
        for packet in self._encoder.encode(sound):
            is_taken = self._handover.put(packet) and is_taken
        return is_taken

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> SoundFeed:
        return self._feeds.setdefault(viewer_id, SoundFeed())

    def watch(self, viewer_id: str, on: bool) -> None:
        feed = self._feeds.get(viewer_id)
        if feed is None:
            return
        others = {name: other for name, other in self._listening.items() if name != viewer_id}
        self._listening = {**others, viewer_id: feed} if on else others
        if not on:
            feed.clear()

    def leave(self, viewer_id: str) -> None:
        self.watch(viewer_id, False)
        self._feeds.pop(viewer_id, None)

    def close(self) -> None:
        self._listening = {}

    def _distribute(self, packet: av.Packet[Any]) -> None:
        for feed in self._listening.values():
            self._counters.dropped += feed.put(packet)
        self._counters.count(packet.size, time.monotonic())
