"""A point cloud as arrays, and how any usual array of points becomes one. Metres, REP-103: x forward, y left, z up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.floating[Any]]
Bytes: TypeAlias = NDArray[np.uint8]
Numbers: TypeAlias = NDArray[Any]

_INTENSITY_NAMES = ("intensity", "i", "scalar_intensity", "reflectivity", "reflectance")
_COLOUR_NAMES = (("r", "g", "b"), ("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"))


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """A cloud of points, as arrays. ``xyz`` (n, 3) in metres, ``float32`` or ``float64``; ``intensity`` (n,) of any
    number type; ``rgb`` (n, 3) ``uint8``. ``captured_at_s``: the robot's monotonic clock. Made by :func:`cloud_of`,
    which checks all of it.
    """

    xyz: Floats
    intensity: Numbers | None = None
    rgb: Bytes | None = None
    frame_id: str = ""
    captured_at_s: float | None = None

    def __len__(self) -> int:
        return len(self.xyz)

    def chosen(self, which: NDArray[np.bool_] | NDArray[np.intp] | slice) -> PointCloud:
        """The points of this mask, these indices (in their order) or this slice."""
        return PointCloud(
            self.xyz[which],
            None if self.intensity is None else self.intensity[which],
            None if self.rgb is None else self.rgb[which],
            self.frame_id,
            self.captured_at_s,
        )


def cloud_of(
    points: Any,
    *,
    intensity: Any = None,
    rgb: Any = None,
    frame_id: str = "",
    captured_at_s: float | None = None,
) -> PointCloud:
    """A cloud of ``points``: an array (…, 3), or (…, 4) with the intensity last, or a structured one with the fields
    ``x``, ``y``, ``z`` and, if it has them, an intensity and a colour under their usual names.

    Points with NaN or an infinity among their coordinates are left out. Raises :class:`ValueError` that names what
    doesn't fit.
    """
    array = np.asarray(points)
    if array.dtype.names:
        xyz, own_intensity, own_rgb = _of_fields(array.reshape(-1), array.dtype.names)
    else:
        xyz, own_intensity = _of_columns(array)
        own_rgb = None
    values = own_intensity if intensity is None else np.asarray(intensity).reshape(-1)
    colours = own_rgb if rgb is None else _colours(np.asarray(rgb))
    for name, column in (("intensity", values), ("rgb", colours)):
        if column is not None and len(column) != len(xyz):
            raise ValueError(f"{name} has {len(column)} rows for {len(xyz)} points")
    if values is not None and values.dtype.kind not in "fuib":
        raise ValueError(f"intensity holds {values.dtype}, not numbers")
    cloud = PointCloud(xyz, values, colours, frame_id, captured_at_s)
    is_finite = np.asarray(np.isfinite(xyz).all(axis=1))
    return cloud if is_finite.all() else cloud.chosen(is_finite)


def _of_columns(array: Numbers) -> tuple[Floats, Numbers | None]:
    if array.size == 0 and array.ndim < 2:
        return np.empty((0, 3), np.float32), None
    if array.ndim < 2 or array.shape[-1] not in (3, 4) or array.dtype.kind not in "fui":
        raise ValueError(f"points of shape {array.shape} and {array.dtype}; (n, 3) or (n, 4) numbers are expected")
    rows = array.reshape(-1, array.shape[-1])
    return _as_floats(rows[:, :3]), rows[:, 3] if rows.shape[1] == 4 else None


def _of_fields(array: Numbers, names: Sequence[str]) -> tuple[Floats, Numbers | None, Bytes | None]:
    lower = {name.lower(): name for name in names}
    missing = [name for name in "xyz" if name not in lower]
    if missing:
        raise ValueError(f"no field {', '.join(missing)} among {', '.join(names)}")
    xyz = np.stack([_as_floats(array[lower[name]]) for name in "xyz"], axis=1)
    found = next((lower[name] for name in _INTENSITY_NAMES if name in lower), None)
    return xyz, None if found is None else array[found], _colour_fields(array, lower)


def _colour_fields(array: Numbers, lower: dict[str, str]) -> Bytes | None:
    for triple in _COLOUR_NAMES:
        if all(name in lower for name in triple):
            return _colours(np.stack([array[lower[name]] for name in triple], axis=1))
    packed = next((lower[name] for name in ("rgb", "rgba") if name in lower), None)
    if packed is None or array[packed].dtype.itemsize != 4:
        return None
    # PCL's way: 0x00RRGGBB in an integer, or in the bits of a float.
    bits = np.ascontiguousarray(array[packed]).view(np.uint32)
    return np.stack([(bits >> shift & 0xFF).astype(np.uint8) for shift in (16, 8, 0)], axis=1)


def _colours(array: Numbers) -> Bytes:
    rows = array.reshape(-1, array.shape[-1]) if array.ndim > 1 else array
    if rows.ndim != 2 or rows.shape[1] != 3 or rows.dtype.kind not in "fui":
        raise ValueError(f"rgb of shape {array.shape} and {array.dtype}; (n, 3) numbers are expected")
    if rows.dtype == np.uint8:
        return rows
    if rows.dtype.kind == "f":  # colours as fractions, the custom of floats
        return np.asarray(np.rint(np.nan_to_num(np.clip(rows, 0.0, 1.0)) * 255), dtype=np.uint8)
    if rows.dtype.itemsize == 2 and rows.size and rows.max() > 255:  # 16 bit per colour
        rows = rows // 257
    return np.clip(rows, 0, 255).astype(np.uint8)


def _as_floats(array: Numbers) -> Floats:
    """Doubles where a float could not hold the numbers, in whatever byte order they came."""
    size = array.dtype.itemsize
    is_wide = size > 4 if array.dtype.kind == "f" else size > 2 and array.dtype.kind in "ui"
    with np.errstate(over="ignore"):  # what is too large for a double is infinite, and no point
        return array.astype(np.float64 if is_wide else np.float32, copy=False)
