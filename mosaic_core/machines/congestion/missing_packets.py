"""Which packets have not arrived by any of the ways that they were sent: as reports of arrivals tell, even when the
receiver's own request to repeat them got lost."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

from mosaic_core.machines.congestion.arrival_report import NUMBERS, ArrivalReport

_REMEMBERED = 2048
"""Packets: some seconds."""


@dataclass(slots=True)
class _Packet:
    on_the_way: int = 0
    has_arrived: bool = False


class MissingPackets:
    """Finds the packets of one stream that have not arrived. Each sending of a packet (``sequence_number``) has a
    ``number`` of its own.
    """

    def __init__(self) -> None:
        self._sendings: OrderedDict[int, int] = OrderedDict()
        self._packets: OrderedDict[int, _Packet] = OrderedDict()

    def sent(self, number: int, sequence_number: int) -> None:
        self._sendings[number] = sequence_number
        self._sendings.move_to_end(number)
        self._packets.setdefault(sequence_number, _Packet()).on_the_way += 1
        self._packets.move_to_end(sequence_number)
        for remembered in (self._sendings, self._packets):
            if len(remembered) > _REMEMBERED:
                remembered.popitem(last=False)

    def reported(self, report: ArrivalReport) -> list[int]:
        """The packets of which this report told the last hope lost."""
        missing = []
        for offset, at_s in enumerate(report.arrivals_s):
            sequence_number = self._sendings.pop((report.first_number + offset) % NUMBERS, None)
            packet = None if sequence_number is None else self._packets.get(sequence_number)
            if sequence_number is None or packet is None:
                continue
            packet.on_the_way -= 1
            packet.has_arrived |= at_s is not None
            if packet.on_the_way <= 0:
                del self._packets[sequence_number]
                if not packet.has_arrived:
                    missing.append(sequence_number)
        return missing
