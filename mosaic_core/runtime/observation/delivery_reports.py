"""Tells operators that ask how the data travels: all counters, once a second and only while somebody asks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from mosaic_core.runtime.observation.counters import ConnectorSnapshot
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.control import DELIVERY_REPORT_PERIOD_S, ControlMessage, DeliveryReport, DeliveryRow


class Reader(Protocol):
    """An operator who reads the reports."""

    def answer(self, message: ControlMessage) -> None: ...


class DeliveryReports:
    """Reports how one robot's data travels to whoever watches it. Event loop only. ``snapshot``: how all its connectors
    are now."""

    def __init__(self, snapshot: Callable[[], Sequence[ConnectorSnapshot]]) -> None:
        self._snapshot = snapshot
        self._readers: list[Reader] = []
        self._told_at_s = float("-inf")
        self._timer = DeadlineTimer(self._tell)

    def watch(self, reader: Reader, on: bool) -> None:
        """The first report comes at once, unless others have just got one."""
        if on and reader not in self._readers:
            self._readers.append(reader)
            if not self._timer.is_set:
                self._timer.set(self._told_at_s + DELIVERY_REPORT_PERIOD_S)
        elif not on and reader in self._readers:
            self._readers.remove(reader)
            if not self._readers:
                self._timer.cancel()

    def _tell(self) -> None:
        self._told_at_s = time.monotonic()
        self._timer.set(self._told_at_s + DELIVERY_REPORT_PERIOD_S)
        report = DeliveryReport(connectors=tuple(map(row_of, self._snapshot())))
        for reader in tuple(self._readers):
            reader.answer(report)


def row_of(snapshot: ConnectorSnapshot) -> DeliveryRow:
    """What an operator learns of a connector."""
    alike = {name: getattr(snapshot, name) for name in DeliveryRow.model_fields if hasattr(snapshot, name)}
    rounded = {"rate_hz": round(snapshot.rate_hz, 2), "bytes_per_s": round(snapshot.bytes_per_s, 1)}
    age_ms = None if snapshot.age_s is None else round(snapshot.age_s * 1000, 1)
    again_s = None if snapshot.tries_again_in_s is None else round(snapshot.tries_again_in_s, 1)
    changed = {"age_ms": age_ms, "failure_code": snapshot.failure_code or None, "tries_again_in_s": again_s}
    return DeliveryRow.model_validate({**alike, **rounded, **changed})
