"""Receiver reports of several streams as if they were of one: a connection lost what all of its streams lost."""

from __future__ import annotations

from collections.abc import Hashable

from mosaic_core.machines.congestion.feedback import ReceiverReport


class StreamReports:
    """Adds up the receiver reports of one connection's streams."""

    def __init__(self) -> None:
        self._lost = self._packets = 0
        self._before: dict[Hashable, ReceiverReport] = {}

    def merged(self, stream: Hashable, report: ReceiverReport) -> ReceiverReport:
        """The connection's, now that this one has come. Where a stream begins is not known: its first report counts
        nothing yet."""
        before = self._before.get(stream, report)
        self._before[stream] = report
        self._lost += report.packets_lost - before.packets_lost
        self._packets += report.highest_sequence - before.highest_sequence
        return ReceiverReport(self._lost, self._packets, report.round_trip_s)
