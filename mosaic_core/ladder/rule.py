"""Declares what a rule of the ladder is, and what comes of asking it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TypeAlias

from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import Fault, Faults, LadderLevel, RuleVerdict
from mosaic_core.ladder.shipment import Shipment


@dataclass(frozen=True, slots=True)
class ShipmentRule:
    """A rule about a distribution as a whole. ``asks``: what must be so; ``why``: what breaks for whom otherwise;
    ``cure``: what its author does about it."""

    name: str
    level: LadderLevel
    asks: str
    why: str
    cure: str
    check: Callable[[Shipment], Faults]


@dataclass(frozen=True, slots=True)
class ConnectorRule:
    """A rule about each connector type; otherwise like :class:`ShipmentRule`. An ``async`` check runs the connector.
    ``mostly_waits``: it is asked of all types side by side, since nothing of theirs can hold up another's."""

    name: str
    level: LadderLevel
    asks: str
    why: str
    cure: str
    check: Callable[[Examinee], Faults | Awaitable[Faults]]
    mostly_waits: bool = False


LadderRule: TypeAlias = ShipmentRule | ConnectorRule


@dataclass(frozen=True, slots=True)
class RuleFinding:
    """What came of one rule: ``subject`` is a connector type or a distribution; ``why_not`` says what was missing where
    it was not judged or does not apply."""

    rule: LadderRule
    subject: str
    verdict: RuleVerdict
    faults: tuple[Fault, ...] = ()
    why_not: str = ""
