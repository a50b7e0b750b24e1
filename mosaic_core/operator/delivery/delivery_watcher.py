"""Asks the robot how its data travels, and keeps what it said last."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from mosaic_core.operator.delivery.listeners import Listeners, first_heard
from mosaic_core.words.control import ControlMessage, DeliveryReport, DeliveryRow, DeliveryWatch

TellDelivery = Callable[[Mapping[str, DeliveryRow]], None]


class DeliveryWatcher:
    """Asks for delivery reports while somebody listens, whatever the peers of the connection. Event loop only.

    ``tell``: says something on the control channel.
    """

    def __init__(self, tell: Callable[[ControlMessage], object]) -> None:
        self._tell = tell
        self._listeners: Listeners[[Mapping[str, DeliveryRow]]] = Listeners()
        self.is_known = False
        """The robot can be asked."""
        self.rows: Mapping[str, DeliveryRow] = {}
        """The last report by label; empty before the first, or if the robot knows none."""

    def watch(self, callback: TellDelivery) -> Callable[[], None]:
        """Call ``callback(rows)`` with every report, once a second; returns what ends it. The robot counts anyway, but
        tells only while somebody watches."""
        end = self._listeners.add(callback)
        if len(self._listeners) == 1:
            self._ask(True)

        def end_and_tell() -> None:
            was_watched = len(self._listeners) > 0
            end()
            if was_watched and not self._listeners:
                self._ask(False)

        return end_and_tell

    async def next_report(self, timeout_s: float = 5.0) -> Mapping[str, DeliveryRow]:
        """The next report; raises :class:`TimeoutError`, as toward robots that know none."""
        async with asyncio.timeout(timeout_s):
            return await first_heard(self.watch)

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello, on this connection."""
        self.is_known = "delivery" in extensions
        if self._listeners:
            self._ask(True)

    def reported(self, report: DeliveryReport) -> None:
        self.rows = {row.label: row for row in report.connectors}
        self._listeners.tell(self.rows)

    def _ask(self, on: bool) -> None:
        if self.is_known:
            self._tell(DeliveryWatch(on=on))
