"""A bus that is made up: says the messages of its DBC files in turn, and repeats what it is sent."""

from __future__ import annotations

import itertools
import math
import queue
from collections.abc import Iterator
from typing import Any

import can
from cantools.database.can.signal import Signal

from mosaic_can.databases import CanDatabase
from mosaic_can.signal_fields import bounds_of

PERIOD_S = 0.02
MAX_ECHOES = 64


class FakeCanBus:
    """Something on it swings; frames that were sent are heard, as if another node had said them."""

    def __init__(self, database: CanDatabase) -> None:
        self._said = self._frames(database)
        self._echoes: queue.Queue[can.Message] = queue.Queue(MAX_ECHOES)
        self.state = can.BusState.ACTIVE

    def _frames(self, database: CanDatabase) -> Iterator[can.Message]:
        messages = [one for one in database.by_name.values() if not one.is_multiplexed()]
        for tick in itertools.count():
            if not messages:
                yield can.Message(arbitration_id=0x201, data=tick.to_bytes(8, "big"), is_extended_id=False)
            for one in messages:
                values: dict[str, Any] = {signal.name: _made_up(signal, tick) for signal in one.signals}
                yield can.Message(
                    arbitration_id=one.frame_id,
                    is_extended_id=one.is_extended_frame,
                    data=one.encode(values, strict=False),
                    is_fd=one.length > 8,
                )

    def recv(self, timeout: float | None = None) -> can.Message | None:
        try:
            return self._echoes.get(timeout=PERIOD_S)
        except queue.Empty:
            return next(self._said)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        try:
            self._echoes.put_nowait(msg)
        except queue.Full:
            raise can.CanOperationError("Transmit buffer full") from None

    def shutdown(self) -> None:
        """Nothing is open."""


def _made_up(signal: Signal, tick: int) -> float:
    if signal.choices:
        raws = sorted(signal.choices)
        return signal.raw_to_scaled(raws[tick // 50 % len(raws)], decode_choices=False)  # type: ignore[return-value]
    low, high = bounds_of(signal) or (-1.0, 1.0)
    value = (low + high) / 2 + (high - low) / 4 * math.sin(tick / 10)
    raw = signal.scaled_to_raw(value)
    return float(signal.raw_to_scaled(raw if signal.is_float else round(raw)))  # type: ignore[arg-type]
