"""MOSAIC's datagrams of points: a header of 16 bytes, then ``float32`` coordinates; a cloud is all parts of one number.

Little-endian throughout, so that a microcontroller can send its arrays as they are::

    offset  0  4 bytes  "MPTS"
            4  u8       version: 1
            5  u8       values per point: 3 (x y z) or 4 (x y z intensity)
            6  u16      points in this datagram
            8  u32      number of the cloud, one more each time
           12  u16      part, from 0
           14  u16      parts of this cloud
           16  f32 × values × points
"""

from __future__ import annotations

import struct
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mosaic_sensors.point_cloud.cloud import Floats

_HEADER = struct.Struct("<4sBBHIHH")
_MAGIC, _VERSION = b"MPTS", 1
_MODULUS = 1 << 32
MAX_CLOUD_BYTES = 2_000_000 * 16
PAYLOAD_BYTES = 1400
"""Of one datagram: what passes any network unfragmented; within one computer up to 65 000 are quicker."""
FORGOTTEN_AFTER_S = 1.0
"""A cloud that is not complete by then never will be; and a sender may begin anew at any number."""
_MAX_SENDERS = 4


def datagrams_of(points: Any, number: int, payload_bytes: int = PAYLOAD_BYTES) -> Iterator[bytes]:
    """The datagrams that carry ``points``, an array (n, 3) or (n, 4)."""
    rows = np.ascontiguousarray(points, dtype="<f4")
    if rows.ndim != 2 or rows.shape[1] not in (3, 4):
        raise ValueError(f"points of shape {rows.shape}; (n, 3) or (n, 4) is expected")
    values = rows.shape[1]
    each = max(1, (payload_bytes - _HEADER.size) // (4 * values))
    parts = max(1, -(-len(rows) // each))
    if parts > 0xFFFF:
        raise ValueError(f"{len(rows)} points make {parts} datagrams of {payload_bytes} bytes; 65535 are the most")
    for part in range(parts):
        some = rows[part * each : (part + 1) * each]
        header = _HEADER.pack(_MAGIC, _VERSION, values, len(some), number % _MODULUS, part, parts)
        yield header + some.tobytes()


@dataclass(slots=True)
class _Cloud:
    number: int
    values: int
    parts: int
    begun_at_s: float
    touched_at_s: float
    received: dict[int, bytes] = field(default_factory=dict)
    size_bytes: int = 0
    is_done: bool = False


@dataclass(frozen=True, slots=True)
class Assembled:
    """A whole cloud: ``points`` (n, 3) or (n, 4), and when its first part arrived."""

    points: Floats
    begun_at_s: float


class Assembly:
    """Joins datagrams of up to four senders to clouds. Knows no clock and no socket; not thread-safe."""

    def __init__(self) -> None:
        self._incomplete = 0
        self._clouds: dict[Hashable, _Cloud] = {}

    def feed(self, datagram: bytes, sender: Hashable, now_s: float) -> Assembled | None:
        """The cloud that ``datagram`` completes. Raises :class:`ValueError` that says what is wrong with it."""
        values, points, number, part, parts = _header(datagram)
        cloud = self._cloud(sender, number, values, parts, now_s)
        if cloud is None or cloud.is_done or part in cloud.received:
            return None
        if (cloud.values, cloud.parts) != (values, parts):
            raise ValueError("parts of one cloud disagree on their number or their values per point")
        body = datagram[_HEADER.size :]
        if cloud.size_bytes + len(body) > MAX_CLOUD_BYTES:
            del self._clouds[sender]
            raise ValueError(f"a cloud of more than {MAX_CLOUD_BYTES // 16} points")
        cloud.received[part] = body
        cloud.size_bytes += 4 * values * points
        cloud.touched_at_s = now_s
        if len(cloud.received) < parts:
            return None
        whole = b"".join(cloud.received[index] for index in range(parts))
        cloud.is_done = True
        cloud.received.clear()
        return Assembled(np.frombuffer(whole, dtype="<f4").reshape(-1, values), cloud.begun_at_s)

    def _cloud(self, sender: Hashable, number: int, values: int, parts: int, now_s: float) -> _Cloud | None:
        """The cloud of this number; ``None`` if a newer one has begun already."""
        cloud = self._clouds.get(sender)
        if cloud is not None and cloud.number == number and now_s - cloud.touched_at_s <= FORGOTTEN_AFTER_S:
            return cloud
        if cloud is not None:
            is_older = (number - cloud.number) % _MODULUS >= _MODULUS // 2
            if is_older and now_s - cloud.touched_at_s <= FORGOTTEN_AFTER_S:
                return None
            self._forget(sender)
        elif len(self._clouds) >= _MAX_SENDERS:
            self._forget(min(self._clouds, key=lambda key: self._clouds[key].touched_at_s))
        made = self._clouds[sender] = _Cloud(number, values, parts, now_s, now_s)
        return made

    def expire(self, now_s: float) -> None:
        """Give up clouds whose parts have stopped coming."""
        for sender in [key for key, cloud in self._clouds.items() if now_s - cloud.touched_at_s > FORGOTTEN_AFTER_S]:
            self._forget(sender)

    def _forget(self, sender: Hashable) -> None:
        self._incomplete += not self._clouds.pop(sender).is_done

    def take_incomplete(self) -> int:
        """How many clouds were given up because parts never came, since it was asked last."""
        incomplete, self._incomplete = self._incomplete, 0
        return incomplete


def _header(datagram: bytes) -> tuple[int, int, int, int, int]:
    if len(datagram) < _HEADER.size:
        raise ValueError("shorter than its header")
    magic, version, values, points, number, part, parts = _HEADER.unpack_from(datagram)
    if magic != _MAGIC or version != _VERSION:
        raise ValueError("it doesn't begin with MPTS and version 1")
    if values not in (3, 4) or part >= parts:
        raise ValueError(f"part {part} of {parts} with {values} values per point")
    if len(datagram) != _HEADER.size + 4 * values * points:
        raise ValueError(f"{len(datagram)} bytes for {points} points of {values} values")
    return values, points, number, part, parts
