"""MOSAIC's compact form of a point cloud: quantized, delta-coded, in byte planes, deflated where that pays.

The layout is documented in ``docs/topics/point-cloud-form.md``; ``tests/wire/payloads/point_clouds.json`` has golden
bytes that the dashboard reads too. In the order of its scanner, a cloud takes a tenth of its 12 bytes per point.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mosaic_core.words.errors import WireError
from mosaic_sensors.point_cloud.cloud import Bytes, Floats, Numbers, PointCloud

MAGIC = b"MPC1"
DEFLATED, WIDE, INTENSITY, COLOUR = 1, 2, 4, 8
_HEADER = struct.Struct("!4sBBHIQddddff")
"""magic, flags, bytes of frame_id, reserved, count, captured_us, resolution_m, origin x y z (m), least and most
intensity."""
MAX_POINTS = 4_000_000
"""A receiver refuses more."""
_NARROW_STEPS, _WIDE_STEPS = 1 << 16, 1 << 32
_ROUGH_SHARE = 0.25
"""If more than this share of the steps from point to point needs a second byte, the order has no neighbourhoods."""
_MAX_FRAME_ID_BYTES = 255


@dataclass(frozen=True, slots=True)
class Encoded:
    """A cloud on its way: its ``header`` for the body as it is, and the ``body``, not deflated yet."""

    header: bytes
    body: bytes

    def plain(self) -> bytes:
        return self.header + self.body

    def deflated(self) -> bytes:
        """Runs and a Huffman code, no search for matches: the deltas have none, and it takes a third of the time."""
        deflate = zlib.compressobj(1, zlib.DEFLATED, zlib.MAX_WBITS, 9, zlib.Z_RLE)
        header = bytearray(self.header)
        header[4] |= DEFLATED
        return b"".join((header, deflate.compress(self.body), deflate.flush()))


def encoded(cloud: PointCloud, resolution_m: float = 0.01) -> Encoded:
    """``cloud`` with every coordinate rounded to ``resolution_m``.

    Points farther than 2^31 steps from the origin of the frame can't be told and are left out.
    """
    steps, cloud = _steps(cloud, resolution_m)
    origin = steps.min(axis=0) if len(steps) else np.zeros(3, dtype=np.int64)
    local = steps - origin
    span = int(local.max()) if len(local) else 0
    bits = 16 if span < _NARROW_STEPS else 32
    order = _better_order(local, bits)
    if order is not None:
        local, cloud = local[order], cloud.chosen(order)
    flags = WIDE if bits == 32 else 0
    body = [_planes(_zigzag(_deltas(local[:, axis], bits), bits), bits) for axis in range(3)]
    low, high = 0.0, 0.0
    if cloud.intensity is not None:
        flags |= INTENSITY
        levels, low, high = _levels(cloud.intensity)
        body.append(levels.tobytes())
    if cloud.rgb is not None:
        flags |= COLOUR
        body += [np.diff(cloud.rgb[:, channel], prepend=np.uint8(0)).tobytes() for channel in range(3)]
    name = _frame_id_bytes(cloud.frame_id)
    captured_us = int(max(cloud.captured_at_s or 0.0, 0.0) * 1e6)
    place = (float(steps_of_one) * resolution_m for steps_of_one in origin)
    header = _HEADER.pack(MAGIC, flags, len(name), 0, len(local), captured_us, resolution_m, *place, low, high)
    return Encoded(header + name, b"".join(body))


def _steps(cloud: PointCloud, resolution_m: float) -> tuple[NDArray[np.int64], PointCloud]:
    scaled = np.rint(cloud.xyz.astype(np.float64) / resolution_m)
    fits = np.asarray((np.abs(scaled) < _WIDE_STEPS // 2).all(axis=1))
    if not fits.all():
        scaled, cloud = scaled[fits], cloud.chosen(fits)
    return scaled.astype(np.int64), cloud


def _better_order(local: NDArray[np.int64], bits: int) -> NDArray[np.intp] | None:
    """Rows along z, y, x where the cloud's own order jumps about; ``None``: leave it."""
    if bits != 16 or len(local) < 2:
        return None
    rough = np.count_nonzero(np.abs(np.diff(local, axis=0)) > 127)
    if rough <= _ROUGH_SHARE * local.size:
        return None
    return np.argsort(local[:, 2] << 32 | local[:, 1] << 16 | local[:, 0])


def _deltas(column: NDArray[np.int64], bits: int) -> NDArray[Any]:
    """From each value to the next, modulo 2^bits, signed; the first from 0."""
    unsigned = column.astype(np.uint16 if bits == 16 else np.uint32)
    steps = np.diff(unsigned, prepend=unsigned.dtype.type(0))
    return np.asarray(steps.view(np.int16 if bits == 16 else np.int32))


def _zigzag(deltas: NDArray[Any], bits: int) -> NDArray[Any]:
    """Small ones of either sign become small unsigned ones: 0, -1, 1, -2 … → 0, 1, 2, 3 …"""
    return np.asarray((deltas << 1) ^ (deltas >> (bits - 1)))


def _planes(values: NDArray[Any], bits: int) -> bytes:
    """All lowest bytes, then all next ones …: the upper planes are nearly all zeros."""
    little = values.astype(f"<i{bits // 8}", copy=False).view(np.uint8).reshape(-1, bits // 8)
    return np.ascontiguousarray(little.T).tobytes()


def _levels(intensity: Numbers) -> tuple[Bytes, float, float]:
    """256 levels between the least and the most; bytes stay what they are."""
    if intensity.dtype == np.uint8:
        return intensity, 0.0, 255.0
    values = np.nan_to_num(intensity.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    values = np.clip(values, -3e38, 3e38)  # what a float32 of the header can hold
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    if high <= low:
        return np.zeros(len(values), dtype=np.uint8), low, low
    return np.rint((values - low) / (high - low) * 255).astype(np.uint8), low, high


def _frame_id_bytes(frame_id: str) -> bytes:
    return frame_id.encode()[:_MAX_FRAME_ID_BYTES].decode(errors="ignore").encode()


def decoded(data: bytes) -> PointCloud:
    """The cloud in ``data``: ``xyz`` as ``float64``, intensity as ``float32`` in its own measure. For Python operators
    and tests. Raises :class:`WireError`."""
    if len(data) < _HEADER.size:
        raise WireError("point cloud: shorter than its header")
    magic, flags, name_bytes, _, count, captured_us, resolution_m, *rest = _HEADER.unpack_from(data)
    origin, (low, high) = np.asarray(rest[:3]), rest[3:]
    if magic != MAGIC:
        raise WireError("point cloud: not in the compact form, or in another version of it")
    if count > MAX_POINTS or not resolution_m > 0 or not np.isfinite([*origin, resolution_m, low, high]).all():
        raise WireError("point cloud: its header makes no sense")
    bits = 32 if flags & WIDE else 16
    planes = 3 * bits // 8 + bool(flags & INTENSITY) + 3 * bool(flags & COLOUR)
    start = _HEADER.size + name_bytes
    if len(data) < start:
        raise WireError("point cloud: shorter than its name")
    body = _body(data[start:], bool(flags & DEFLATED), count * planes)
    rows = np.frombuffer(body, dtype=np.uint8).reshape(planes, count)
    each = bits // 8
    steps = [_column(rows[axis * each : (axis + 1) * each], bits) for axis in range(3)]
    xyz = np.stack(steps, axis=1) * resolution_m + origin
    after = 3 * each
    intensity = rgb = None
    if flags & INTENSITY:
        intensity = (rows[after] * ((high - low) / 255) + low).astype(np.float32)
        after += 1
    if flags & COLOUR:
        rgb = np.cumsum(rows[after : after + 3], axis=1, dtype=np.uint8).T
    name = data[_HEADER.size : start].decode(errors="replace")
    return PointCloud(xyz, intensity, rgb, name, captured_us / 1e6)


def _body(data: bytes, is_deflated: bool, size_bytes: int) -> bytes:
    if is_deflated:
        inflate = zlib.decompressobj()
        try:
            data = inflate.decompress(data, size_bytes + 1)
        except zlib.error as error:
            raise WireError(f"point cloud: {error}") from None
    if len(data) != size_bytes:
        raise WireError("point cloud: its body has another size than its header says")
    return data


def _column(planes: Bytes, bits: int) -> Floats:
    little = np.ascontiguousarray(planes.T).reshape(-1)
    zigzag = little.view(f"<u{bits // 8}").astype(np.uint32)
    deltas = (zigzag >> np.uint32(1)) ^ (np.uint32(0) - (zigzag & np.uint32(1)))
    steps = np.cumsum(deltas, dtype=np.uint32)
    return np.asarray(steps & np.uint32(_NARROW_STEPS - 1) if bits == 16 else steps).astype(np.float64)
