"""One turn of a planar scanner as arrays, and as the JSON message of original dashboards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mosaic_core.words.wire_model import to_json

MAX_RAYS = 65_535


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One turn of a planar laser scanner. ``ranges_m`` (n,) metres, NaN: no return. Angles count counter-clockwise from
    straight ahead (REP-103). ``intensities`` (n,) of any number type. ``captured_at_s``: the robot's monotonic clock.
    Made by :func:`scan_of`.
    """

    ranges_m: NDArray[np.float32]
    angle_min_rad: float
    angle_increment_rad: float
    intensities: NDArray[Any] | None = None
    range_min_m: float = 0.0
    range_max_m: float = math.inf
    scan_time_s: float = 0.0
    frame_id: str = ""
    captured_at_s: float | None = None

    def __len__(self) -> int:
        return len(self.ranges_m)


def scan_of(
    ranges_m: Any,
    angle_min_rad: float,
    angle_increment_rad: float,
    *,
    intensities: Any = None,
    range_min_m: float = 0.0,
    range_max_m: float = math.inf,
    scan_time_s: float = 0.0,
    frame_id: str = "",
    captured_at_s: float | None = None,
) -> Scan:
    """A scan of ``ranges_m``: whatever is not finite, not positive or outside of the range is no return.

    Raises :class:`ValueError` that names what doesn't fit.
    """
    ranges = np.asarray(ranges_m, dtype=np.float32).copy()
    if ranges.ndim != 1 or len(ranges) > MAX_RAYS:
        raise ValueError(f"ranges of shape {ranges.shape}; (n,) with at most {MAX_RAYS} is expected")
    if not math.isfinite(angle_min_rad) or not math.isfinite(angle_increment_rad):
        raise ValueError("angle_min and angle_increment must be finite")
    values = None if intensities is None or len(intensities) == 0 else np.asarray(intensities)
    if values is not None and (values.shape != ranges.shape or values.dtype.kind not in "fuib"):
        raise ValueError(f"intensities of shape {values.shape} and {values.dtype} for {len(ranges)} ranges")
    with np.errstate(invalid="ignore"):
        ranges[~((ranges > 0) & (ranges >= range_min_m) & (ranges <= range_max_m) & np.isfinite(ranges))] = np.nan
    return Scan(
        ranges,
        angle_min_rad,
        angle_increment_rad,
        values,
        range_min_m,
        range_max_m,
        scan_time_s,
        frame_id,
        captured_at_s,
    )


def scan_of_json(message: Mapping[str, Any], captured_at_s: float | None = None, frame_id: str = "") -> Scan:
    """A message with the keys of ROS' LaserScan; ``null`` is no return. Raises :class:`ValueError`."""
    try:
        ranges = np.array([np.nan if one is None else one for one in message["ranges"]], dtype=np.float32)
        return scan_of(
            ranges,
            float(message["angle_min"]),
            float(message["angle_increment"]),
            intensities=message.get("intensities"),
            range_min_m=float(message.get("range_min") or 0.0),
            range_max_m=float(message.get("range_max") or math.inf),
            scan_time_s=float(message.get("scan_time") or 0.0),
            frame_id=frame_id,
            captured_at_s=captured_at_s,
        )
    except KeyError as error:
        raise ValueError(f"no {error} in it") from None
    except TypeError as error:
        raise ValueError(f"no scan: {error}") from None


def json_of(scan: Scan) -> str:
    """The message that original dashboards read: ``null`` for no return, millimetres."""
    count = len(scan)
    rounded = np.round(scan.ranges_m.astype(np.float64), 3).tolist()
    intensities = [] if scan.intensities is None else np.nan_to_num(scan.intensities).tolist()
    return to_json(
        {
            "angle_min": scan.angle_min_rad,
            "angle_max": scan.angle_min_rad + max(0, count - 1) * scan.angle_increment_rad,
            "angle_increment": scan.angle_increment_rad,
            "time_increment": scan.scan_time_s / max(1, count),
            "scan_time": scan.scan_time_s,
            "range_min": scan.range_min_m,
            "range_max": scan.range_max_m if math.isfinite(scan.range_max_m) else 1000.0,
            "ranges": [None if one != one else one for one in rounded],
            "intensities": intensities,
        }
    )
