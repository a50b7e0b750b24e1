"""The original page's point clouds: protobuf Meta and Chunk messages, told apart by trying, gathered per frame."""

from __future__ import annotations

import struct
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
