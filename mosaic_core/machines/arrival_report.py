"""Reads what browsers report about the arrival of every packet: transport-wide congestion control feedback, RTCP 205/15
(draft-holmer-rmcat-transport-wide-cc-extensions-01 §3.1).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from struct import error as StructError
from struct import unpack_from

RTPFB, ARRIVALS = 205, 15
NUMBERS = 1 << 16
"""Packets are numbered modulo this, across all streams of a connection."""
_FIRST_CHUNK = 20
_REFERENCE_S = 0.064
_DELTA_S = 0.000_25
_SMALL, _LARGE = 1, 2
_MAX_PACKETS = 8192


@dataclass(frozen=True, slots=True)
class ArrivalReport:
    """When packets arrived, by the receiver's clock; ``None``: not (yet). One per number from ``first_number`` on."""

    first_number: int
    arrivals_s: tuple[float | None, ...]


def arrival_reports(rtcp: bytes) -> list[ArrivalReport]:
    """All reports in one (compound) RTCP packet. What can't be read is left out: it comes from the network."""
    reports, position = [], 0
    while position + 4 <= len(rtcp):
        first, kind, words = unpack_from("!BBH", rtcp, position)
        size = (words + 1) * 4
        if kind == RTPFB and first & 0x1F == ARRIVALS:
            with suppress(StructError, ValueError):
                reports.append(_report(rtcp[position : position + size]))
        position += size
    return reports


def _report(data: bytes) -> ArrivalReport:
    first_number, count, reference = unpack_from("!HHL", data, 12)
    if count > _MAX_PACKETS:
        raise ValueError("too many packets in one report")
    symbols, position = _symbols(data, count)
    ticks = reference >> 8
    at_s = (ticks - (1 << 24) if ticks & 0x800000 else ticks) * _REFERENCE_S
    arrivals: list[float | None] = []
    for symbol in symbols:
        if symbol == _SMALL:
            at_s += data[position] * _DELTA_S if position < len(data) else _missing()
            position += 1
        elif symbol == _LARGE:
            at_s += unpack_from("!h", data, position)[0] * _DELTA_S
            position += 2
        arrivals.append(at_s if symbol in (_SMALL, _LARGE) else None)
    return ArrivalReport(first_number, tuple(arrivals))


def _symbols(data: bytes, count: int) -> tuple[list[int], int]:
    """What is known of each packet, and where the times begin."""
    symbols: list[int] = []
    position = _FIRST_CHUNK
    while len(symbols) < count:
        (chunk,) = unpack_from("!H", data, position)
        position += 2
        if not chunk & 0x8000:
            symbols += [chunk >> 13 & 3] * min(chunk & 0x1FFF, count - len(symbols))
            if not chunk & 0x1FFF:
                raise ValueError("a run of no packets")
        elif chunk & 0x4000:
            symbols += [chunk >> shift & 3 for shift in range(12, -2, -2)]
        else:
            symbols += [chunk >> shift & 1 for shift in range(13, -1, -1)]
    return symbols[:count], position


def _missing() -> float:
    raise ValueError("the report ends too soon")
