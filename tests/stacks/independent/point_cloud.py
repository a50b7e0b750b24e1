"""The original page's point clouds: protobuf Meta and Chunk messages, told apart by trying, gathered per frame."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

FLOAT32 = 7


def fields_of(message: bytes) -> dict[int, list[Any]]:
    """Field number → values of a protobuf message: integers, doubles, and bytes for whatever has a length."""
    found: dict[int, list[Any]] = {}
    for number, value in _fields(message):
        found.setdefault(number, []).append(value)
    return found


def _fields(message: bytes) -> Iterator[tuple[int, Any]]:
    at = 0
    while at < len(message):
        tag, at = _varint(message, at)
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            value, at = _varint(message, at)
            yield number, value
        elif kind == 1:
            yield number, struct.unpack_from("<d", message, at)[0]
            at += 8
        elif kind == 2:
            size, at = _varint(message, at)
            yield number, message[at : at + size]
            at += size
        else:
            raise ValueError(f"wire type {kind}")


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


def _tag(number: int, kind: int) -> bytes:
    return _number(number << 3 | kind)


def _number(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _part(number: int, value: int | float | bytes) -> bytes:
    if isinstance(value, bytes):
        return _tag(number, 2) + _number(len(value)) + value
    if isinstance(value, float):
        return _tag(number, 1) + struct.pack("<d", value)
    return _tag(number, 0) + _number(value)


def messages_of(points: np.ndarray[Any, Any], frame: str, chunk_points: int) -> list[bytes]:
    """A cloud (n, 4) as the original robot's newer sensor package sends it: a Meta and its Chunks."""
    head = _part(1, time.time() * 1e6) + _part(2, frame.encode())
    box = [float(bound) for axis in range(3) for bound in (points[:, axis].min(), points[:, axis].max())]
    count = len(points) // chunk_points  # one less than the chunks that follow, where there is a remainder
    sizes = _part(3, 1) + _part(4, len(points)) + _part(6, 16) + _part(7, 16 * len(points)) + _part(8, 1)
    bounds = b"".join(_part(number, bound) for number, bound in enumerate(box, start=9))
    fields = [
        _part(1, name.encode()) + _part(2, 4 * index) + _part(3, FLOAT32) + _part(4, 1)
        for index, name in enumerate(("x", "y", "z", "intensity"))
    ]
    meta = head + sizes + bounds + _part(15, count) + b"".join(_part(16, field) for field in fields)
    chunks = [points[at : at + chunk_points] for at in range(0, len(points), chunk_points)]
    return [
        meta,
        *(
            head + _part(3, index) + _part(4, len(chunk)) + _part(5, chunk.astype("<f4").tobytes())
            for index, chunk in enumerate(chunks)
        ),
    ]


class CloudStore:
    """Gathers what arrives on all channels of one connector; :attr:`clouds` are (n, 4) arrays of x, y, z, intensity."""

    def __init__(self) -> None:
        self.clouds: list[np.ndarray[Any, Any]] = []
        self._meta: dict[int, list[Any]] = {}
        self._chunks: dict[int, bytes] = {}

    def take(self, message: str | bytes) -> None:
        assert isinstance(message, bytes), "a cloud travels in binary frames"
        found = fields_of(message)
        if 16 in found:
            names = [fields_of(field)[1][0].decode() for field in found[16]]
            assert {"x", "y", "z", "intensity"} <= set(names)
            assert all(fields_of(field)[3][0] == FLOAT32 for field in found[16])
            self._meta, self._chunks = found, {}
        elif self._meta and found[2] == self._meta[2]:
            self._chunks[found.get(3, [0])[0]] = found.get(5, [b""])[0]  # proto3 leaves defaults out
            if len(self._chunks) >= self._meta.get(15, [0])[0] - 1:
                self._finish()

    def _finish(self) -> None:
        step = self._meta[6][0]
        raw = b"".join(self._chunks[index] for index in sorted(self._chunks))
        offsets = {fields_of(field)[1][0].decode(): fields_of(field).get(2, [0])[0] for field in self._meta[16]}
        rows = np.frombuffer(raw, np.uint8).reshape(-1, step)
        columns = [
            rows[:, offsets[name] : offsets[name] + 4].copy().view("<f4") for name in ("x", "y", "z", "intensity")
        ]
        self.clouds.append(np.hstack(columns))
