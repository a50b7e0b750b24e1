"""The exercise of positions: after a safe action, whoever tells it to be where it is must not move it."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Mapping

from mosaic_core.contract.handler import reports_position
from mosaic_core.drill.command_stream import BEGIN_S, CommandStream, moving, position_of
from mosaic_core.drill.commands import GENTLE
from mosaic_core.drill.fields import limits_on
from mosaic_core.drill.findings import ExerciseFailed, NotExercised, Passed
from mosaic_core.drill.rig import DrilledReceiver, Rig
from mosaic_core.drill.silence import AT_ONCE_S, DRIVE_S, safe_act

TOLD = 2
"""Positions that are told by name."""
SENSOR_SHARE = 0.02
"""How much of its place a sensor may be wrong by, beside :data:`~mosaic_core.drill.commands.GENTLE`."""
SEEN = 3
"""So many times that error it is brought away before its commander leaves: a way back is seen then."""
STEPS = 20
"""On that way: a second of commands, so that nothing jumps."""


async def holds_position(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Its commander leaves, the safe action runs, and the next one tells it to be where it is. A live drill brings it
    elsewhere before: earlier safe actions may have left it where this one would swing it to."""
    if subject.command is None or not subject.command.positions:
        raise NotExercised("it takes no positions")
    if not reports_position(subject.handler):
        kind = type(subject.handler).__name__
        raise NotExercised(
            f"it does not report its position, where a command begins: write reported_position in {kind}"
        )
    if subject.safety.on_loss == "hold":
        raise NotExercised("on_loss: hold")
    async with moving(rig, subject) as stream:
        await stream.drive(DRIVE_S)
        if rig.is_live:
            await _bring_elsewhere(stream)
        left_s = time.monotonic()
        await stream.who.connection.close()
        await safe_act(subject, left_s, AT_ONCE_S)
    began_s = time.monotonic()
    async with moving(rig, subject) as stream:
        reported = await _reports_while_driven(stream)
    acts = subject.recorder.commands_since(began_s)
    for field in stream.command.positions:
        place = stream.command.at(stream.command.message, field)
        sent = max((stream.command.at(act.value, field) for act in acts), key=lambda value: abs(value - place))
        _check(field, place, sent, 1e-9 * max(1.0, abs(place)), "sent")
        for value in reported[field]:
            _check(field, place, value, _error_at(place), "moved")
    places = {field: stream.command.at(stream.command.message, field) for field in stream.command.positions}
    why = "" if rig.is_live else "its own reported_position is not asked in a dry drill: --live asks it"
    return Passed(in_words(places), "it stayed", why)


async def _bring_elsewhere(stream: CommandStream) -> None:
    """Move every position whose range is known a little, slowly, and wait until it is there."""
    command, safety = stream.command, stream.subject.safety
    ways: dict[str, tuple[float, float]] = {}
    for field in command.positions:
        its, place = limits_on(field, safety.limits, safety.lists), command.at(command.message, field)
        low = max((one.min for one in its if one.min is not None), default=-math.inf)
        high = min((one.max for one in its if one.max is not None), default=math.inf)
        ways[field] = place, elsewhere(place, low, high)
    for step in range(1, STEPS + 1):
        stream.command = command.placed(_on_the_way(ways, step / STEPS).get)
        stream.say()
        await asyncio.sleep(stream.period_s)
    ends_at_s = time.monotonic() + BEGIN_S
    while time.monotonic() < ends_at_s and not all(_is_at(stream, field, to) for field, (_, to) in ways.items()):
        await stream.drive(stream.period_s)


def elsewhere(place: float, low: float, high: float) -> float:
    """A place away from this one, towards the farther end of the range and at most half the way; the same place where
    an end is not known."""
    if not (math.isfinite(low) and math.isfinite(high)) or not low <= place <= high:
        return place
    room = high - place if high - place >= place - low else low - place
    return place + math.copysign(min(SEEN * _error_at(place), abs(room) / 2), room)


def _on_the_way(ways: Mapping[str, tuple[float, float]], share: float) -> dict[str, float]:
    return {field: start + (end - start) * share for field, (start, end) in ways.items()}


def _error_at(place: float) -> float:
    """What a sensor may be wrong by there."""
    return GENTLE + SENSOR_SHARE * abs(place)


def _is_at(stream: CommandStream, field: str, place: float) -> bool:
    value = position_of(stream.subject, field)
    return value is not None and abs(value - place) <= _error_at(place)


def in_words(places: Mapping[str, float]) -> str:
    """Where it shall be; of an arm with many joints the first ones, so that it stays one line of a table."""
    told = [f"{field} = {place:g}" for field, place in places.items()]
    more = len(told) - TOLD
    return " and ".join(told if more <= 0 else [*told[: TOLD - 1], f"{more + 1} more"])


async def _reports_while_driven(stream: CommandStream) -> dict[str, list[float]]:
    """What it says of where it is while it is told to stay."""
    reported: dict[str, list[float]] = {field: [] for field in stream.command.positions}
    ends_at_s = time.monotonic() + DRIVE_S
    while time.monotonic() < ends_at_s:
        stream.say()
        await asyncio.sleep(stream.period_s)
        for field, values in reported.items():
            value = position_of(stream.subject, field)
            values += [value] if value is not None and math.isfinite(value) else []
    return reported


def _check(field: str, place: float, value: float, tolerance: float, done: str) -> None:
    if abs(value - place) > tolerance:
        why = f"told to stay after a safe action, it was {done} elsewhere: a swing of {abs(value - place):g}"
        raise ExerciseFailed(why, limit=f"{field} = {place:g}", measured=f"{value:g}")
