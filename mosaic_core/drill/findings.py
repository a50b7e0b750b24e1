"""Tells the findings of a drill: one line per exercise and receiver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

DrillVerdict = Literal["passed", "failed", "skipped"]
TOLERANCE_S = 0.1
"""What threads and the event loop of a busy machine may add to a limit."""


@dataclass(frozen=True, slots=True)
class DrillFinding:
    """What one exercise of the drill found. ``limit`` and ``measured`` are words with units; ``why`` says what was
    wrong, or why it was not exercised; ``gate``: what on the way of a command refused it, where something must be
    refused.
    """

    exercise: str
    label: str
    verdict: DrillVerdict
    limit: str = ""
    measured: str = ""
    why: str = ""
    measured_s: float | None = None
    gate: str = ""


class NotExercised(Exception):
    """This receiver can't be exercised this way; the text says why."""


class ExerciseFailed(Exception):
    """A receiver did not do in an exercise what it must."""

    def __init__(self, why: str, *, limit: str = "", measured: str = "") -> None:
        super().__init__(why)
        self.limit = limit
        self.measured = measured


class NothingMoved(ExerciseFailed):
    """A receiver carried out no command. ``is_refused``: it refused them all itself."""

    def __init__(self, why: str, *, is_refused: bool) -> None:
        super().__init__(why)
        self.is_refused = is_refused


@dataclass(frozen=True, slots=True)
class Passed:
    """An exercise that a receiver passed: the limit, and what was measured."""

    limit: str
    measured: str
    why: str = ""
    measured_s: float | None = None
    gate: str = ""


def in_time(measured_s: float, limit_s: float, *, why: str = "", gate: str = "") -> Passed:
    """Passed if it took no longer than its limit; else raises :class:`ExerciseFailed`."""
    limit, measured = f"{limit_s * 1e3:.0f} ms", f"{measured_s * 1e3:.0f} ms"
    if measured_s > limit_s + TOLERANCE_S:
        raise ExerciseFailed("too late", limit=limit, measured=measured)
    return Passed(limit, measured, why, measured_s, gate)
