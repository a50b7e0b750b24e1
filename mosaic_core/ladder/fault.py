"""Declares the words of the ladder: its rungs, verdicts, and the faults that break a rule."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from mosaic_core.words.errors import NOWHERE, CodeLine

LadderLevel = Literal["bronze", "silver", "gold"]
LEVELS: tuple[LadderLevel, ...] = get_args(LadderLevel)
"""From the lowest rung up; who stands on one stands on those below."""
RuleVerdict = Literal["passed", "failed", "not judged", "does not apply"]


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that breaks a rule. ``place``: its file and, where one can be named, the line. ``trace``: the traceback
    of an error, for the author."""

    message: str
    place: CodeLine = NOWHERE
    trace: str = ""


class NotJudged(Exception):
    """A rule can't be judged by what is at hand; the text says what is missing."""


class DoesNotApply(Exception):
    """A rule asks for something that this connector has no use for; the text says why."""


Faults: TypeAlias = Iterable[Fault]
