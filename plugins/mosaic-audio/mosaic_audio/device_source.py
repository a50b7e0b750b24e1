"""Records what a sound device hears, with the time when it heard it. Only the newest 200 ms wait: latency never piles
up."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

from mosaic_audio.devices import OpenStream, chosen_device
from mosaic_core import Sound

PIECE_S = 0.02
MAX_WAITING = 10
WAKE_S = 0.2
"""How often the body looks whether it shall stop."""
LOST_S = 2.0
"""A device that gave nothing for this long is gone, though its driver may not say so."""
MAX_DELAY_S = 0.5
"""A driver that claims more than this between hearing and telling has no clock worth asking."""


def device_sounds(
    sounds: Any, device: int | str, rate_hz: int, channels: int | None, is_stopping: Callable[[], bool]
) -> Iterator[Sound]:
    """Until ``is_stopping``. Raises :class:`DeviceGone` when the device can't be opened or falls silent."""
    wanted, has = chosen_device(sounds, device, "input")
    inbox = _Inbox(rate_hz)
    options = {"samplerate": rate_hz, "channels": min(channels or 1, has), "blocksize": round(rate_hz * PIECE_S)}
    with OpenStream(sounds, "input", device=wanted, callback=inbox.heard, **options) as stream:
        silent_s = 0.0
        while not is_stopping():
            piece = inbox.next(WAKE_S)
            silent_s = 0.0 if piece is not None else silent_s + WAKE_S
            if piece is not None:
                yield piece
            elif silent_s >= LOST_S:
                raise stream.lost()


class _Inbox:
    """Queues the newest sound. Filled on PortAudio's thread, emptied on the body's."""

    def __init__(self, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._pieces: deque[Sound] = deque(maxlen=MAX_WAITING)
        self._filled = threading.Condition()

    def heard(self, samples: Any, frames: int, times: Any, status: Any) -> None:
        """PortAudio's callback; ``samples`` are its own and must be copied."""
        delay_s = times.currentTime - times.inputBufferAdcTime
        if not 0.0 <= delay_s <= MAX_DELAY_S:
            delay_s = frames / self._rate_hz
        piece = Sound(samples.copy(), self._rate_hz, time.monotonic() - delay_s)
        with self._filled:
            self._pieces.append(piece)
            self._filled.notify()

    def next(self, timeout_s: float) -> Sound | None:
        with self._filled:
            self._filled.wait_for(lambda: self._pieces, timeout_s)
            return self._pieces.popleft() if self._pieces else None
