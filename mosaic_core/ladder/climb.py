"""Asks every rule of the ladder of a distribution and its connectors, and says which rung it stands on."""

from __future__ import annotations

import asyncio
import gc
import inspect
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager

from mosaic_core.ladder.bronze_rules import BRONZE
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import LEVELS, DoesNotApply, Fault, LadderLevel, NotJudged
from mosaic_core.ladder.gold_rules import GOLD
from mosaic_core.ladder.rule import ConnectorRule, LadderRule, RuleFinding, ShipmentRule
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.silver_rules import SILVER
from mosaic_core.ladder.source_places import place_of_error, trace_of

RULES: tuple[LadderRule, ...] = (*BRONZE, *SILVER, *GOLD)
"""All rules, from the lowest rung up."""
RESTARTS = 100
SIDE_BY_SIDE = 4
"""So few that a time-out of one is not late for the work of the others."""


async def climb(
    shipment: Shipment,
    up_to: LadderLevel = "gold",
    *,
    restarts: int = RESTARTS,
    only: Collection[str] = (),
    tell: Callable[[str], object] | None = None,
) -> AsyncIterator[RuleFinding]:
    """The findings of all rules up to ``up_to``, as they come: first about the distribution, then type by type.

    Runs the plugin's code in this process; what it raises where a rule expects nothing is a fault. ``only``: the names
    of rules, all by default. ``tell`` hears of an import that takes long, in place of the log.
    """
    within = [rule for rule in RULES if LEVELS.index(rule.level) <= LEVELS.index(up_to)]
    rules = [rule for rule in within if not only or rule.name in only]
    for rule in rules:
        if isinstance(rule, ShipmentRule):
            yield await _finding(rule, shipment.name, shipment)
    with _older_things_set_aside():
        examinees = [Examinee(shipment, one, restarts=restarts, tell=tell) for one in shipment.connectors()]
        early: dict[str, list[RuleFinding]] = {}
        for rule in filter(_mostly_waits, rules):
            early[rule.name] = await _side_by_side(rule, examinees)
            _set_aside()  # what has been imported for it
        for number, examinee in enumerate(examinees):
            for rule in rules:
                if rule.name in early:
                    yield early[rule.name][number]
                elif isinstance(rule, ConnectorRule):
                    yield await _finding(rule, examinee.connector_type, examinee)


def _mostly_waits(rule: LadderRule) -> bool:
    return isinstance(rule, ConnectorRule) and rule.mostly_waits


async def _side_by_side(rule: LadderRule, examinees: Sequence[Examinee]) -> list[RuleFinding]:
    """The findings of one rule about each connector, a few at a time."""
    free = asyncio.Semaphore(SIDE_BY_SIDE)

    async def found(one: Examinee) -> RuleFinding:
        async with free:
            return await _finding(rule, one.connector_type, one)

    return await asyncio.gather(*map(found, examinees))


@contextmanager
def _older_things_set_aside() -> Iterator[None]:
    """What a connector leaves open is found after a collection of garbage, which takes a tenth of a second of a large
    program if it looks at all that was there before. A program that has set its own aside wants it to stay there."""
    are_aside = gc.get_freeze_count() > 0
    _set_aside()
    try:
        yield
    finally:
        if not are_aside:
            gc.unfreeze()


def _set_aside() -> None:
    gc.collect()  # garbage would stay
    gc.freeze()


async def _finding(rule: LadderRule, subject: str, asked: Shipment | Examinee) -> RuleFinding:
    try:
        told = rule.check(asked)  # type: ignore[arg-type]  # each rule is asked of its own kind
        faults = tuple(await told if inspect.isawaitable(told) else told)
    except NotJudged as reason:
        return RuleFinding(rule, subject, "not judged", why_not=str(reason))
    except DoesNotApply as reason:
        return RuleFinding(rule, subject, "does not apply", why_not=str(reason))
    except Exception as error:  # noqa: BLE001 - what a plugin's code raises where nobody expects it is its fault
        message, place = f"it could not be examined: {type(error).__name__}: {error}", place_of_error(error)
        place = asked.place if isinstance(asked, Examinee) and not place.file else place
        faults = (Fault(message, place, trace_of(error)),)
    return RuleFinding(rule, subject, "failed" if faults else "passed", faults)


def reached(findings: Iterable[RuleFinding]) -> LadderLevel | None:
    """The highest rung that was asked for, with nothing failed or left unjudged on it and below; ``None``: not even
    the lowest."""
    asked = list(findings)
    missing = {one.rule.level for one in asked if one.verdict in ("failed", "not judged")}
    reachable = {one.rule.level for one in asked} - missing
    stands: LadderLevel | None = None
    for level in LEVELS:
        if level not in reachable:
            break
        stands = level
    return stands


def is_reached(level: LadderLevel, findings: Sequence[RuleFinding]) -> bool:
    """Whether they stand on ``level`` or above."""
    stands = reached(findings)
    return stands is not None and LEVELS.index(stands) >= LEVELS.index(level)
