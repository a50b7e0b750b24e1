"""Reports about the arrival of every packet, read and written: transport-wide congestion control feedback, RTCP 205/15
(draft-holmer-rmcat-transport-wide-cc-extensions-01 §3.1). Browsers send them, and so do our own operators.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import takewhile
from struct import error as StructError
from struct import pack, unpack_from

RTPFB, ARRIVALS = 205, 15
NUMBERS = 1 << 16
"""Packets are numbered modulo this, across all streams of a connection."""
_FIRST_CHUNK = 20
TICK_S = 0.000_25
"""Times are told in these."""
_REFERENCE_TICKS = 256
_MISSING, _SMALL, _LARGE = 0, 1, 2
_BITS, _PAIRS, _LONGEST_RUN = 14, 7, 0x1FFF
"""What one chunk tells of: so many packets."""
_MAX_PACKETS = 8192


@dataclass(frozen=True, slots=True)
class ArrivalReport:
    """The times when packets arrived, by the receiver's clock; ``None``: not (yet). One per number from
    ``first_number`` on."""

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
    at_s = (ticks - (1 << 24) if ticks & 0x800000 else ticks) * _REFERENCE_TICKS * TICK_S
    arrivals: list[float | None] = []
    for symbol in symbols:
        if symbol == _SMALL:
            at_s += data[position] * TICK_S if position < len(data) else _missing()
            position += 1
        elif symbol == _LARGE:
            at_s += unpack_from("!h", data, position)[0] * TICK_S
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


# -- writing ---------------------------------------------------------------------------------------------------------


def written(report: ArrivalReport, sender_ssrc: int, media_ssrc: int, count: int) -> bytes:
    """An RTCP packet; it is the ``count``-th of this connection. Arrivals that follow each other in ``report`` are at
    most eight seconds apart, as :class:`~mosaic_core.machines.congestion.arrival_log.ArrivalLog` makes them."""
    ticks = [None if at_s is None else round(at_s / TICK_S) for at_s in report.arrivals_s]
    reference = next((one for one in ticks if one is not None), 0) // _REFERENCE_TICKS
    symbols: list[int] = []
    times, before = b"", reference * _REFERENCE_TICKS
    for at in ticks:
        if at is None:
            symbols.append(_MISSING)
            continue
        is_small = 0 <= at - before <= 0xFF
        symbols.append(_SMALL if is_small else _LARGE)
        times += pack("!B" if is_small else "!h", at - before)
        before = at
    head = pack("!LLHH", sender_ssrc, media_ssrc, report.first_number, len(ticks))
    told = pack("!L", (reference & 0xFFFFFF) << 8 | count & 0xFF)
    body = head + told + _chunks(symbols) + times
    body += bytes(-len(body) % 4)
    return pack("!BBH", 0x80 | ARRIVALS, RTPFB, len(body) // 4) + body


def _chunks(symbols: Sequence[int]) -> bytes:
    """Long runs as such, else fourteen bits where no time needs two bytes, else seven pairs of bits."""
    chunks, position = b"", 0
    while position < len(symbols):
        following = symbols[position : position + _BITS]
        run = sum(1 for _ in takewhile(following[0].__eq__, symbols[position:]))
        if run >= _BITS:
            run = min(run, _LONGEST_RUN)
            chunks += pack("!H", following[0] << 13 | run)
        elif _LARGE in following:
            run = _PAIRS
            pairs = enumerate(following[:_PAIRS])
            chunks += pack("!H", 0xC000 | sum(symbol << 12 - 2 * place for place, symbol in pairs))
        else:
            run = _BITS
            chunks += pack("!H", 0x8000 | sum(symbol << 13 - place for place, symbol in enumerate(following)))
        position += run
    return chunks
