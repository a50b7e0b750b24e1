"""Asks every rule of the ladder of a distribution and its connectors, and says which rung it stands on."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterator, Collection, Iterable, Sequence

from mosaic_core.ladder.bronze_rules import BRONZE
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import LEVELS, DoesNotApply, Fault, Level, NotJudged
from mosaic_core.ladder.gold_rules import GOLD
from mosaic_core.ladder.rule import ConnectorRule, LadderRule, RuleFinding, ShipmentRule
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.silver_rules import SILVER
from mosaic_core.ladder.source_places import place_of_error, trace_of

RULES: tuple[LadderRule, ...] = (*BRONZE, *SILVER, *GOLD)
"""All rules, from the lowest rung up."""
RESTARTS = 100


async def climb(
    shipment: Shipment, up_to: Level = "gold", *, restarts: int = RESTARTS, only: Collection[str] = ()
) -> AsyncIterator[RuleFinding]:
    """The findings of all rules up to ``up_to``, as they come: first about the distribution, then type by type.

    Runs the plugin's code in this process; what it raises where a rule expects nothing is a fault. ``only``: the names
    of rules, all by default.
    """
    within = [rule for rule in RULES if LEVELS.index(rule.level) <= LEVELS.index(up_to)]
    rules = [rule for rule in within if not only or rule.name in only]
    for rule in rules:
        if isinstance(rule, ShipmentRule):
            yield await _finding(rule, shipment.name, shipment)
    for entry_point in shipment.connectors():
        examinee = Examinee(shipment, entry_point, restarts=restarts)
        for rule in rules:
            if isinstance(rule, ConnectorRule):
                yield await _finding(rule, examinee.connector_type, examinee)


async def _finding(rule: LadderRule, subject: str, asked: Shipment | Examinee) -> RuleFinding:
    try:
        told = rule.check(asked)  # type: ignore[arg-type]  # each rule is asked of its own kind
        faults = tuple(await told if inspect.isawaitable(told) else told)
    except NotJudged as reason:
        return RuleFinding(rule, subject, "not judged", why_not=str(reason))
    except DoesNotApply as reason:
        return RuleFinding(rule, subject, "does not apply", why_not=str(reason))
    except Exception as error:  # noqa: BLE001 - what a plugin's code raises where nobody expects it is its fault
        message = f"it could not be examined: {type(error).__name__}: {error}"
        faults = (Fault(message, place_of_error(error), trace_of(error)),)
    return RuleFinding(rule, subject, "failed" if faults else "passed", faults)


def reached(findings: Iterable[RuleFinding]) -> Level | None:
    """The highest rung that was asked for, with nothing failed or left unjudged on it and below; ``None``: not even
    the lowest."""
    asked = list(findings)
    missing = {one.rule.level for one in asked if one.verdict in ("failed", "not judged")}
    reachable = {one.rule.level for one in asked} - missing
    stands: Level | None = None
    for level in LEVELS:
        if level not in reachable:
            break
        stands = level
    return stands


def is_reached(level: Level, findings: Sequence[RuleFinding]) -> bool:
    """Whether they stand on ``level`` or above."""
    stands = reached(findings)
    return stands is not None and LEVELS.index(stands) >= LEVELS.index(level)
