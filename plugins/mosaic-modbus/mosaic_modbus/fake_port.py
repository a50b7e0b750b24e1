"""A device that is made up: remembers what is written, and what nobody wrote swings."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence

from mosaic_modbus.plan import Block, Write

ANSWER_S = 0.002
"""As a quick device on TCP takes."""


class FakeModbusPort:
    """Answers for every device and address."""

    def __init__(self) -> None:
        self._written: dict[tuple[int, str, int], int] = {}
        self._lock = threading.Lock()
        self._began_s = time.monotonic()

    def open(self) -> None:
        """There is nothing to open."""

    def read(self, device_id: int, block: Block) -> Sequence[int]:
        time.sleep(ANSWER_S)
        with self._lock:
            return [self._word(device_id, block.kind, block.address + at) for at in range(block.count)]

    def _word(self, device_id: int, kind: str, address: int) -> int:
        written = self._written.get((device_id, kind, address))
        if written is not None:
            return written
        swing = math.sin((time.monotonic() - self._began_s) / 2 + address)
        return int(swing > 0) if kind in ("coil", "discrete") else round(500 + 400 * swing)

    def write(self, device_id: int, write: Write) -> None:
        time.sleep(ANSWER_S)
        with self._lock:
            for at, word in enumerate(write.words):
                self._written[device_id, write.kind, write.address + at] = word

    def close(self) -> None:
        """There is nothing to close."""
