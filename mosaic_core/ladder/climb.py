"""Asks every rule of the ladder of a distribution and its connectors, and says which rung it stands on."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterator, Iterable, Sequence
from typing import cast

from mosaic_core.ladder.bronze_rules import BRONZE
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.gold_rules import GOLD
from mosaic_core.ladder.rule import (
    LEVELS,
    ConnectorRule,
    DoesNotApply,
    Fault,
    Faults,
    LadderRule,
    Level,
    NotJudged,
    RuleFinding,
    ShipmentRule,
)
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.silver_rules import SILVER
from mosaic_core.ladder.source_places import place_of_error, trace_of

RULES: tuple[LadderRule, ...] = (*BRONZE, *SILVER, *GOLD)
"""All rules, from the lowest rung up."""
RESTARTS = 100


async def climb(shipment: Shipment, up_to: Level = "gold", *, restarts: int = RESTARTS) -> AsyncIterator[RuleFinding]:
    """The findings of all rules up to ``up_to``, as they come: first about the distribution, then type by type.

    Runs the plugin's code in this process; a rule of its own that breaks is a fault of the plugin.
    """
    rules = [rule for rule in RULES if LEVELS.index(rule.level) <= LEVELS.index(up_to)]
    for rule in rules:
        if isinstance(rule, ShipmentRule):
            yield await _finding(rule, shipment.name, shipment)
    for entry_point in shipment.connectors():
        examinee = Examinee(shipment, entry_point, restarts=restarts)
        for rule in rules:
            if isinstance(rule, ConnectorRule):
                yield await _finding(rule, examinee.type, examinee)


async def _finding(rule: LadderRule, subject: str, asked: Shipment | Examinee) -> RuleFinding:
    try:
        told = rule.check(asked)  # type: ignore[arg-type]  # each rule is asked of its own kind
        faults = tuple(cast("Faults", await told if inspect.isawaitable(told) else told))
    except NotJudged as reason:
        return RuleFinding(rule, subject, "not judged", why_not=str(reason))
    except DoesNotApply as reason:
        return RuleFinding(rule, subject, "does not apply", why_not=str(reason))
    except Exception as error:  # noqa: BLE001 - what a plugin's code raises where nobody expects it is its fault
        message = f"it could not be examined: {type(error).__name__}: {error}"
        faults = (Fault(message, place_of_error(error), trace_of(error)),)
    return RuleFinding(rule, subject, "failed" if faults else "passed", faults)


def reached(findings: Iterable[RuleFinding]) -> Level | None:
    """The highest rung below which nothing failed and nothing was left unjudged; ``None``: not even the lowest."""
    missing = {one.rule.level for one in findings if one.verdict in ("failed", "not judged")}
    stands: Level | None = None
    for level in LEVELS:
        if level in missing:
            break
        stands = level
    return stands


def is_reached(level: Level, findings: Sequence[RuleFinding]) -> bool:
    """Whether they stand on ``level`` or above."""
    stands = reached(findings)
    return stands is not None and LEVELS.index(stands) >= LEVELS.index(level)
