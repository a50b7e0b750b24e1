"""Puts the texts of a vehicle together: MAVLink cuts long ones into chunks. Pure and bounded."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from mosaic_core.messages import wall_time_us

Level: TypeAlias = Literal["debug", "info", "warn", "error", "fatal"]
CHUNK_CHARACTERS = 50
MAX_CHUNKS = 20
KEPT_TEXTS = 100
_LEVELS: tuple[Level, ...] = ("fatal", "fatal", "fatal", "error", "warn", "info", "info", "debug")
"""By ``MAV_SEVERITY``: emergency, alert, critical, error, warning, notice, info, debug."""


@dataclass(frozen=True, slots=True)
class StatusText:
    """One text. ``number`` counts all of this vehicle since the link was made."""

    number: int
    level: Level
    text: str
    stamp_us: int


class StatusTexts:
    """The newest texts of a vehicle. ``hear`` and ``note`` on one thread; ``since`` on any."""

    def __init__(self, wall_us: Callable[[], int] = wall_time_us) -> None:
        self._wall_us = wall_us
        self._kept: deque[StatusText] = deque(maxlen=KEPT_TEXTS)
        self._open: tuple[int, int, list[str]] | None = None
        self.count = 0

    def hear(self, message: Any) -> None:
        """Take one ``STATUSTEXT``. A chunk that got lost is ``…`` in the text."""
        text = printable(message.text)
        identity, chunk = getattr(message, "id", 0), getattr(message, "chunk_seq", 0)
        if self._open is not None and (identity != self._open[0] or identity == 0):
            self._close()
        if identity == 0:
            self._add(message.severity, text)
            return
        if self._open is None:
            self._open = (identity, message.severity, [])
        parts = self._open[2]
        if len(parts) < chunk <= MAX_CHUNKS:
            parts += ["…"] * (chunk - len(parts))
        parts.append(text)
        if len(text) < CHUNK_CHARACTERS or len(parts) >= MAX_CHUNKS:
            self._close()

    def note(self, level: Level, text: str) -> None:
        """Add a text of ours, for those who read what the vehicle says."""
        self.count += 1
        self._kept.append(StatusText(self.count, level, text, self._wall_us()))

    def _close(self) -> None:
        if self._open is not None:
            _, severity, parts = self._open
            self._open = None
            self._add(severity, "".join(parts))

    def _add(self, severity: int, text: str) -> None:
        self.note(_LEVELS[min(severity, len(_LEVELS) - 1)], text)

    def since(self, number: int) -> list[StatusText]:
        """Those after ``number``, as far as they are kept."""
        return [one for one in tuple(self._kept) if one.number > number]


def printable(text: str | bytes) -> str:
    """``text`` of a vehicle without what a terminal or a page would stumble over."""
    plain = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    return "".join(one if one.isprintable() else " " for one in plain.partition("\0")[0])
