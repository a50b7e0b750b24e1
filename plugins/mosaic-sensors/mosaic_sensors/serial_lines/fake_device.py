"""Devices that are made up: they speak and listen like one at the end of a serial line."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from mosaic_core.contract.described_message import DescribedField
from mosaic_sensors.lines import Lines

PERIOD_S = 0.1


class FakeLineDevice(Protocol):
    def pieces(self) -> Iterator[tuple[float, bytes]]:
        """What it says: a pause in seconds, and the bytes after it. Without end."""
        ...

    def hear(self, data: bytes) -> None:
        """What is written to it. Any thread."""
        ...


class FakeJsonDevice:
    """Tells ``fields`` ten times a second; of those that it was commanded, the last command."""

    def __init__(self, fields: Mapping[str, DescribedField]) -> None:
        self._fields = fields
        self._commanded: dict[str, Any] = {}
        self._lines = Lines()

    def pieces(self) -> Iterator[tuple[float, bytes]]:
        tick = 0
        while True:
            yield PERIOD_S, json.dumps(self._said(tick)).encode() + b"\n"
            tick += 1

    def _said(self, tick: int) -> dict[str, Any]:
        if not self._fields:
            return {"uptime_s": round(tick * PERIOD_S, 1), **self._commanded}
        made_up = {
            "number": round(math.sin(tick * PERIOD_S), 3), "integer": tick, "boolean": tick % 20 < 10, "text": "fake",
        }  # fmt: skip
        return {key: self._commanded.get(key, made_up[field.type]) for key, field in self._fields.items()}

    def hear(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            self._commanded = {**self._commanded, **json.loads(line)}


class FakeTextDevice:
    """Tells its uptime once a second, and repeats what it hears."""

    def __init__(self) -> None:
        self._heard: list[bytes] = []
        self._lines = Lines()

    def pieces(self) -> Iterator[tuple[float, bytes]]:
        tick = 0
        while True:
            heard, self._heard = self._heard, []
            echoes = b"".join(b"heard: " + line + b"\r\n" for line in heard)
            said = b"uptime %d s\r\n" % (tick // 10) if tick % 10 == 0 else b""
            yield PERIOD_S, echoes + said
            tick += 1

    def hear(self, data: bytes) -> None:
        self._heard += self._lines.feed(data)
