"""Asks the robot how its data travels, and keeps what it said last."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from mosaic_core.words.control import ControlMessage, DeliveryReport, DeliveryRow, DeliveryWatch

Told = Callable[[Mapping[str, DeliveryRow]], None]


class DeliveryWatcher:
    """Of one connection, whatever its peers; event loop only. ``tell``: says something on the control channel."""

    def __init__(self, tell: Callable[[ControlMessage], object]) -> None:
        self._tell = tell
        self._callbacks: list[Told] = []
        self.is_known = False
        """The robot can be asked."""
        self.rows: Mapping[str, DeliveryRow] = {}
        """The last report by label; empty before the first, or if the robot knows none."""

    def watch(self, callback: Told) -> Callable[[], None]:
        """Call ``callback(rows)`` with every report, once a second; returns what ends it. The robot counts anyway, but
        tells only while somebody watches."""
        self._callbacks.append(callback)
        if len(self._callbacks) == 1:
            self._ask(True)
        return lambda: self._end(callback)

    async def next_report(self, timeout_s: float = 5.0) -> Mapping[str, DeliveryRow]:
        """The next report; raises :class:`TimeoutError`, as toward robots that know none."""
        arrived: asyncio.Future[Mapping[str, DeliveryRow]] = asyncio.get_running_loop().create_future()
        end = self.watch(lambda rows: None if arrived.done() else arrived.set_result(rows))
        try:
            async with asyncio.timeout(timeout_s):
                return await arrived
        finally:
            end()

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello, on this connection."""
        self.is_known = "delivery" in extensions
        if self._callbacks:
            self._ask(True)

    def heard(self, report: DeliveryReport) -> None:
        self.rows = {row.label: row for row in report.connectors}
        for callback in list(self._callbacks):
            callback(self.rows)

    def _end(self, callback: Told) -> None:
        if callback in self._callbacks:
            self._callbacks.remove(callback)
            if not self._callbacks:
                self._ask(False)

    def _ask(self, on: bool) -> None:
        if self.is_known:
            self._tell(DeliveryWatch(on=on))
