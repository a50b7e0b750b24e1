"""Decides when an event loop counts as blocked, and who of those on its stack is to blame. Knows neither clock nor
thread.

A guard asks the loop to answer, and looks again every :data:`LOOK_PERIOD_S`. What the whole machine or the guard itself
was late does not count: then everybody stood still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

LOOK_PERIOD_S = 0.125
BLOCKED_S = 0.2
"""A loop that doesn't come round for so long costs pictures and commands of every operator."""
GOES_ON_S = 2.0
"""One that is still blocked then may be for ever: it is told before it is over."""
_LATE_S = 0.05
"""The guard is a thread like others: so late it wakes at any time."""


@dataclass(frozen=True, slots=True)
class StackFrame:
    """A line that runs or waits for the line that it has called. ``label``: of the connector that it belongs to, as far
    as can be seen there; ``is_plugin``: it is code of a plugin."""

    file: str
    line: int
    function: str
    label: str = ""
    is_plugin: bool = False
    is_library: bool = False
    """It is Python's own."""


@dataclass(frozen=True, slots=True)
class Blame:
    """The line that holds up the loop; ``label`` is empty where no connector's code is on the stack."""

    label: str
    file: str
    line: int
    function: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} in {self.function}"


def blamed(stack: Sequence[StackFrame]) -> Blame | None:
    """Who of ``stack`` (the innermost first) can change it: the innermost line of a plugin, else the innermost that is
    not Python's own, else the innermost. ``None``: the loop is busy with many small things."""
    ours = [frame for frame in stack if not frame.is_library]
    frame = next((frame for frame in ours if frame.is_plugin), next(iter([*ours, *stack]), None))
    if frame is None:
        return None
    label = next((one.label for one in stack if one.label), "")
    return Blame(label, frame.file, frame.line, frame.function)


@dataclass(frozen=True, slots=True)
class AskLoop:
    """Let the loop answer when it comes round."""


@dataclass(frozen=True, slots=True)
class LookAtStack:
    """The loop is late: see what it does now."""


@dataclass(frozen=True, slots=True)
class TellBlocked:
    """The event loop was blocked for so long; ``is_over``: it has come round since."""

    duration_s: float
    is_over: bool


Effect = AskLoop | LookAtStack | TellBlocked


class LoopWatch:
    """The machine of one loop. ``now_s`` is any monotonic clock."""

    def __init__(self, now_s: float) -> None:
        self._asked_at_s = now_s
        self._looked_at_s = now_s
        self._state: Literal["free", "late", "told"] = "free"
        self._is_asked = False

    def look(self, now_s: float, *, has_answered: bool) -> list[Effect]:
        """The guard looks, once a period. ``has_answered``: the loop has, to the last :class:`AskLoop`."""
        own_delay_s = now_s - self._looked_at_s - LOOK_PERIOD_S
        self._looked_at_s = now_s
        if own_delay_s > _LATE_S:
            self._asked_at_s = min(now_s, self._asked_at_s + own_delay_s)
        if not self._is_asked or has_answered:
            return self._answered(now_s)
        late_s = now_s - self._asked_at_s
        if late_s < BLOCKED_S:
            return []
        if self._state == "free":
            self._state = "late"
            return [LookAtStack()]
        if self._state == "late" and late_s >= GOES_ON_S:
            self._state = "told"
            return [LookAtStack(), TellBlocked(late_s, is_over=False)]
        return []

    def _answered(self, now_s: float) -> list[Effect]:
        told = [TellBlocked(now_s - self._asked_at_s, is_over=True)] if self._state != "free" else []
        self._state, self._is_asked, self._asked_at_s = "free", True, now_s
        return [*told, AskLoop()]
