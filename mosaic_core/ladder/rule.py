"""Declares what a rule of the ladder is, and what comes of asking it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

if TYPE_CHECKING:
    from mosaic_core.ladder.examinee import Examinee
    from mosaic_core.ladder.shipment import Shipment

Level = Literal["bronze", "silver", "gold"]
LEVELS: tuple[Level, ...] = get_args(Level)
"""From the lowest rung up; who stands on one stands on those below."""
Verdict = Literal["passed", "failed", "not judged", "does not apply"]


@dataclass(frozen=True, slots=True)
class CodePlace:
    """Where a fault is: a file and, where one can be named, its line."""

    file: str = ""
    line: int | None = None

    def __str__(self) -> str:
        return ":".join(str(part) for part in (self.file, self.line) if part)


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that breaks a rule. ``trace``: the traceback of an error, for the author."""

    message: str
    place: CodePlace = field(default_factory=CodePlace)
    trace: str = ""


class NotJudged(Exception):
    """A rule can't be judged by what is at hand; the text says what is missing."""


class DoesNotApply(Exception):
    """A rule asks for something that this connector has no use for; the text says why."""


Faults: TypeAlias = Iterable[Fault]


@dataclass(frozen=True, slots=True)
class ShipmentRule:
    """A rule about a distribution as a whole. ``asks``: what must be so; ``why``: what breaks for whom otherwise;
    ``cure``: what its author does about it."""

    name: str
    level: Level
    asks: str
    why: str
    cure: str
    check: Callable[[Shipment], Faults]


@dataclass(frozen=True, slots=True)
class ConnectorRule:
    """A rule about each connector type; otherwise like :class:`ShipmentRule`. An ``async`` check runs the connector."""

    name: str
    level: Level
    asks: str
    why: str
    cure: str
    check: Callable[[Examinee], Faults | Awaitable[Faults]]


LadderRule: TypeAlias = ShipmentRule | ConnectorRule


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """What came of one rule: ``subject`` is a connector type or a distribution; ``why_not`` says what was missing where
    it was not judged or does not apply."""

    rule: LadderRule
    subject: str
    verdict: Verdict
    faults: tuple[Fault, ...] = ()
    why_not: str = ""
