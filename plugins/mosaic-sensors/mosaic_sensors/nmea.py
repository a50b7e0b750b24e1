"""NMEA 0183 lines to positions. Pure: bytes and the time in, positions out; the syntax is pynmeagps's business.

One position per epoch: GGA leads, RMC adds speed, course and date, GSA the dilution. Where no GGA comes, RMC leads.
What is no valid sentence is counted and skipped: a serial line starts in the middle of one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from typing import Any

from pynmeagps import NMEAReader  # type: ignore[import-untyped]
from pynmeagps.exceptions import (  # type: ignore[import-untyped]
    NMEAMessageError,
    NMEAParseError,
    NMEAStreamError,
    NMEATypeError,
)

KNOT_MPS = 1852 / 3600
"""International nautical mile per hour (SI Brochure, table 8)."""
FIXES = {
    0: "none",
    1: "gps",
    2: "dgps",
    3: "pps",
    4: "rtk",
    5: "float-rtk",
    6: "estimated",
    7: "manual",
    8: "simulated",
}
"""GGA's quality indicator in words."""


@dataclass(frozen=True, slots=True)
class NmeaPosition:
    """The position of the antenna: WGS84 degrees, metres above mean sea level. ``None``: the receiver does not say.

    ``course_rad`` is clockwise from true north, as navigation counts it. ``time_utc`` needs an RMC for its date.
    """

    fix: str
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    altitude_m: float | None = None
    satellites: int | None = None
    hdop: float | None = None
    vdop: float | None = None
    speed_mps: float | None = None
    course_rad: float | None = None
    time_utc: datetime | None = None


def parsed(line: bytes) -> Any | None:
    """The sentence in ``line`` as pynmeagps has it; ``None`` if it is none or its checksum is wrong."""
    try:
        return NMEAReader.parse(line.strip() + b"\r\n")
    except (NMEAParseError, NMEAMessageError, NMEATypeError, NMEAStreamError):
        return None


@dataclass(slots=True)
class PositionTracker:
    """Collects sentences into positions."""

    bad_lines: int = 0
    _speed_mps: float | None = None
    _course_rad: float | None = None
    _hdop: float | None = None
    _vdop: float | None = None
    _reference: datetime | None = None
    _rmc_since_gga: int = 0

    def feed(self, sentence: Any | None) -> NmeaPosition | None:
        """The position that ``sentence`` (of :func:`parsed`) completes, if it does."""
        kind = sentence.msgID if sentence is not None else None
        if kind is None:
            self.bad_lines += 1
            return None
        if kind == "GSA":
            self._hdop, self._vdop = _number(sentence, "HDOP"), _number(sentence, "VDOP")
        position = self._gga(sentence) if kind == "GGA" else self._rmc(sentence) if kind == "RMC" else None
        if position is not None and not _is_on_earth(position):
            self.bad_lines += 1
            return None
        return position

    def _gga(self, sentence: Any) -> NmeaPosition:
        self._rmc_since_gga = 0
        fix = FIXES.get(getattr(sentence, "quality", 0) or 0, "none")
        has_fix = fix != "none"
        satellites = _number(sentence, "numSV")
        hdop = _number(sentence, "HDOP")
        return NmeaPosition(
            fix=fix,
            latitude_deg=_number(sentence, "lat") if has_fix else None,
            longitude_deg=_number(sentence, "lon") if has_fix else None,
            altitude_m=_number(sentence, "alt") if has_fix else None,
            satellites=None if satellites is None else int(satellites),
            hdop=self._hdop if hdop is None else hdop,
            vdop=self._vdop,
            speed_mps=self._speed_mps if has_fix else None,
            course_rad=self._course_rad if has_fix else None,
            time_utc=self._dated(getattr(sentence, "time", None)),
        )

    def _rmc(self, sentence: Any) -> NmeaPosition | None:
        is_valid = getattr(sentence, "status", "V") == "A"
        knots, course_deg = _number(sentence, "spd"), _number(sentence, "cog")
        self._speed_mps = knots * KNOT_MPS if is_valid and knots is not None else None
        self._course_rad = math.radians(course_deg) if is_valid and course_deg is not None else None
        day, clock = getattr(sentence, "date", None), getattr(sentence, "time", None)
        if isinstance(day, date) and isinstance(clock, time):
            self._reference = datetime.combine(day, clock, UTC)
        self._rmc_since_gga += 1
        if self._rmc_since_gga < 2:
            return None  # the GGA of this epoch may still come
        return NmeaPosition(
            fix="gps" if is_valid else "none",
            latitude_deg=_number(sentence, "lat") if is_valid else None,
            longitude_deg=_number(sentence, "lon") if is_valid else None,
            hdop=self._hdop,
            vdop=self._vdop,
            speed_mps=self._speed_mps,
            course_rad=self._course_rad,
            time_utc=self._dated(clock),
        )

    def _dated(self, clock: Any) -> datetime | None:
        """``clock`` on the day that is nearest to the last RMC: a GGA just after midnight may precede its date."""
        if self._reference is None or not isinstance(clock, time):
            return None
        moment = datetime.combine(self._reference.date(), clock, UTC)
        days = round((self._reference - moment) / timedelta(days=1))
        return moment + timedelta(days=days)


def _number(sentence: Any, name: str) -> float | None:
    value = getattr(sentence, name, None)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _is_on_earth(position: NmeaPosition) -> bool:
    """Also ``False`` for a fix without a place: its checksum was right, its numbers were not."""
    if position.fix == "none":
        return True
    latitude_deg, longitude_deg = position.latitude_deg, position.longitude_deg
    if latitude_deg is None or longitude_deg is None:
        return False
    return abs(latitude_deg) <= 90 and abs(longitude_deg) <= 180
