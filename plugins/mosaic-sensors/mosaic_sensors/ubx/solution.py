"""NAV-PVT, a receiver's whole solution of one epoch, as a position. Pure."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Any

from mosaic_core.messages import GpsFix

NAV_PVT = b"\x01\x07"
_ALONE = {1: "estimated", 2: "gps", 3: "gps", 4: "gps"}
"""fixType: 1 dead reckoning alone, 2 and 3 satellites, 4 both; 0 none, 5 the time alone."""
_CARRIER = {1: "float-rtk", 2: "rtk"}
SIGMAS_OF_95_PERCENT = 2.0
"""hAcc is one sigma; a position's accuracy here holds 95 % of the time."""


def fix_of(solution: Any, now_us: int) -> GpsFix:
    """The position in a NAV-PVT that pyubx2 has read. ``now_us``: UTC of this computer, until the receiver knows it."""
    fix = _word_of(solution)
    is_known = fix != "none"
    return GpsFix(
        latitude=solution.lat if is_known else None,
        longitude=solution.lon if is_known else None,
        altitude=solution.height / 1000 if is_known else None,
        timestamp=_utc_us(solution) or now_us,
        fix=fix,
        satellites=solution.numSV,
        accuracy_m=solution.hAcc / 1000 * SIGMAS_OF_95_PERCENT if is_known else None,
        speed_mps=max(0.0, solution.gSpeed / 1000) if is_known else None,
        course_rad=math.radians(solution.headMot % 360) if is_known else None,
    )


def _word_of(solution: Any) -> str:
    if not solution.gnssFixOk or solution.invalidLlh or abs(solution.lat) > 90 or abs(solution.lon) > 180:
        return "none"
    alone = _ALONE.get(solution.fixType, "none")
    if alone != "gps":
        return alone
    return _CARRIER.get(solution.carrSoln, "dgps" if solution.diffSoln else "gps")


def _utc_us(solution: Any) -> int | None:
    """UTC since 1970, or ``None``. The nanoseconds may be negative: they round the second up."""
    if not (solution.validDate and solution.validTime):
        return None
    try:
        whole = datetime(
            solution.year,
            solution.month,
            solution.day,
            solution.hour,
            solution.min,
            min(solution.second, 59),
            tzinfo=UTC,
        )
    except ValueError:
        return None
    leap_s = int(solution.second) - whole.second
    return (int(whole.timestamp()) + leap_s) * 1_000_000 + round(int(solution.nano) / 1000)
