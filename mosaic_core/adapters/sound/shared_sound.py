"""Shares one microphone among its listeners: sound is resampled and encoded once, everybody gets the same packets, and
whoever takes them too slowly loses the oldest.
"""

from __future__ import annotations

from typing import Any

import av

from mosaic_core.adapters.sound.sound_encoder import SoundEncoder
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.runtime.media.plain_stream import NewestFeed, PlainStream
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.media_transport import OPUS

MAX_WAITING = 10
"""Packets of 20 ms that wait for one listener's transport."""
_MAX_HANDED_OVER = 50
"""One second on its way to the event loop."""


class SoundFeed(NewestFeed):
    """Holds the packets of one listener. None is sent again: Opus repairs a loss from the next packet, and a repeat
    comes too late."""

    codec_order = (OPUS,)

    def __init__(self) -> None:
        super().__init__(MAX_WAITING)


class SharedSound(PlainStream):
    """Encodes one microphone's sound once for all listeners; a ``runtime.transport.SoundStream``."""

    def __init__(self, label: str, encoding: SoundEncoding, counters: ConnectorCounters) -> None:
        self._encoder = SoundEncoder(encoding.bitrate_bps)
        super().__init__(self._encoder.encode, counters, SoundFeed, _MAX_HANDED_OVER)

    def offer(self, item: Sound) -> bool:
        """See ``SoundStream``. Raises :class:`TypeError` or :class:`ValueError` for what is no sound."""
        if not self._watching:
            self._encoder.rest()
            return False
        is_taken = True
        for packet in self._encoder.encode(item):
            is_taken = self._handover.put(packet) and is_taken
        return is_taken

    def _size_bytes(self, item: av.Packet[Any]) -> int:
        return item.size
