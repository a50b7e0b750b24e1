"""The exercises of positions: a safe action must not move it, nor whoever tells it afterwards to be where it is."""

from __future__ import annotations

import asyncio
import math
import statistics
import time
from collections.abc import Mapping, Sequence
from typing import TypeAlias

from mosaic_core.contract.handler import reports_position
from mosaic_core.drill.command_stream import BEGIN_S, CommandStream, moving
from mosaic_core.drill.commands import GENTLE
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
HELD_S = 1.0
"""So long nobody commands after its safe action: a slow swing is seen by then."""
STEADY_SHARE = 0.2
"""What stands still repeats what it said to this share of the error: a sensor is wrong by much more than it wavers."""

Reported: TypeAlias = Mapping[str, Sequence[float]]
"""By field, what it said of where it is, one after the other."""


async def tells_position(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Whether it says where it is: nothing else of it is exercised live where it does not."""
    if subject.command is None or not subject.command.positions:
        raise NotExercised("it takes no positions")
    if not rig.is_live:
        raise NotExercised("its own reported_position is not asked in a dry drill: --live asks it")
    return Passed("", in_words(await subject.reports.known(subject.command.positions)))


async def holds_position(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Its commander leaves, the safe action runs, and the next one tells it to be where it is. A live drill brings it
    elsewhere before, for earlier safe actions may have left it where this one would swing it to, and looks on for a
    while before anybody commands again."""
    if subject.command is None or not subject.command.positions:
        raise NotExercised("it takes no positions")
    if not reports_position(subject.handler):
        kind = type(subject.handler).__name__
        raise NotExercised(
            f"it does not report its position, where a command begins: write reported_position in {kind}"
        )
    if subject.safety.on_loss == "hold":
        raise NotExercised("on_loss: hold")
    errors = dict.fromkeys(subject.command.positions, math.inf)
    odd = ""
    async with moving(rig, subject) as stream:
        await stream.drive(DRIVE_S)
        if rig.is_live:
            errors, odd = await _bring_elsewhere(stream)
            stood = await _at_rest(stream, errors)
        last_s = subject.recorder.began_at_s  # on a busy machine the time-out of the last one may be over by now
        await stream.who.connection.close()
        await safe_act(subject, last_s, AT_ONCE_S)
        if rig.is_live:
            await _stays(subject, stood, errors)
    began_s = time.monotonic()
    async with moving(rig, subject) as stream:
        reported = await _reports_while_driven(stream)
    acts = subject.recorder.commands_since(began_s)
    for field in stream.command.positions:
        place = stream.command.at(stream.command.message, field)
        sent = max((stream.command.at(act.value, field) for act in acts), key=lambda value: abs(value - place))
        _check(field, place, sent, 1e-9 * max(1.0, abs(place)), "sent", odd)
        for value in reported[field]:
            _check(field, place, value, min(errors[field], _error_at(place)), "moved", odd)
    places = {field: stream.command.at(stream.command.message, field) for field in stream.command.positions}
    why = "" if rig.is_live else "its own reported_position is not asked in a dry drill: --live asks it"
    return Passed(in_words(places), "it stayed", odd or why)


async def _bring_elsewhere(stream: CommandStream) -> tuple[dict[str, float], str]:
    """Move every position whose range is known a little, slowly, and wait until it is there. What each may be off by
    there, never as much as the way that it was brought; and what is odd about how far it came."""
    command, safety = stream.command, stream.subject.safety
    ways: dict[str, tuple[float, float]] = {}
    for field in command.positions:
        place = command.at(command.message, field)
        ways[field] = place, elsewhere(place, *safety.range_of(field))
    for step in range(1, STEPS + 1):
        stream.command = command.placed(_on_the_way(ways, step / STEPS).get)
        stream.say()
        await asyncio.sleep(stream.period_s)
    errors = {field: error_after(*way) for field, way in ways.items()}
    ends_at_s = time.monotonic() + BEGIN_S
    while time.monotonic() < ends_at_s and not await _is_there(stream, errors):
        await stream.drive(stream.period_s)
    return errors, not_brought(ways, await stream.subject.reports.now(command.positions))


def not_brought(ways: Mapping[str, tuple[float, float]], said: Mapping[str, float | None]) -> str:
    """Tells of a field that was brought along its way for seconds and did not even go half of it, as where the device
    takes, or tells, another unit than that of the message; also a switch does, which knows two places alone."""
    for field, (start, end) in ways.items():
        place = said[field]
        if place is not None and abs(place - end) > abs(end - start) / 2 > 0.0:
            told = f"told for {BEGIN_S:g} s to be at {field} = {end:g}, it stood at {place:g}"
            return f"{told}: are what its device takes and what it tells in the unit of the message?"
    return ""


def elsewhere(place: float, low: float, high: float) -> float:
    """A place away from this one, towards the farther end of the range and at most half the way; the same place where
    an end is not known."""
    if not (math.isfinite(low) and math.isfinite(high)) or not low <= place <= high:
        return place
    room = high - place if high - place >= place - low else low - place
    return place + math.copysign(min(SEEN * _error_at(place), abs(room) / 2), room)


def error_after(start: float, end: float) -> float:
    """What a sensor may be wrong by at ``end``; in a small range little, so that the way from ``start`` is seen."""
    return min(_error_at(end), abs(end - start) / SEEN) if end != start else _error_at(end)


def _on_the_way(ways: Mapping[str, tuple[float, float]], share: float) -> dict[str, float]:
    return {field: start + (end - start) * share for field, (start, end) in ways.items()}


def _error_at(place: float) -> float:
    """What a sensor may be wrong by there."""
    return GENTLE + SENSOR_SHARE * abs(place)


async def _is_there(stream: CommandStream, errors: Mapping[str, float]) -> bool:
    """Whether it says that it is where it was told to be."""
    command, places = stream.command, await stream.subject.reports.now(stream.command.positions)
    return all(
        place is not None and abs(place - command.at(command.message, field)) <= errors[field]
        for field, place in places.items()
    )


async def _at_rest(stream: CommandStream, errors: Mapping[str, float]) -> Reported:
    """What it says while it is told to stay, once that no longer changes; where it wavers for long, what it says
    then."""
    ends_at_s = time.monotonic() + BEGIN_S
    while True:
        reported = await _reports_while_driven(stream)
        is_still = all(_spread(said) <= STEADY_SHARE * errors[field] for field, said in reported.items())
        if is_still or time.monotonic() >= ends_at_s:
            return reported


async def _stays(subject: DrilledReceiver, stood: Reported, errors: Mapping[str, float]) -> None:
    """Nobody commands it: it must say for a second that it is where it stood."""
    said: dict[str, list[float]] = {field: [] for field in stood}
    ends_at_s = time.monotonic() + HELD_S
    while time.monotonic() < ends_at_s:
        for field, place in (await subject.reports.now(tuple(stood))).items():
            said[field] += [] if place is None else [place]
        await asyncio.sleep(HELD_S / STEPS)
    for field in stood:
        check_held(field, stood[field], said[field], errors[field])


def check_held(field: str, stood: Sequence[float], said: Sequence[float], error: float) -> None:
    """Raises :class:`ExerciseFailed` where it ``said`` that it is elsewhere than it ``stood``, as far as its sensor,
    which is wrong by ``error`` at most, can tell."""
    if not stood or not said:
        return
    stood_at = statistics.median(stood)
    farthest = max(said, key=lambda place: abs(place - stood_at))
    if abs(farthest - stood_at) > min(error, max(STEADY_SHARE * error, 2 * _spread(stood))):
        moved = f"its safe action moved it by {abs(farthest - stood_at):.3g} within {HELD_S:g} s"
        why = f"{moved}: it must hold, for somebody may stand beside it"
        raise ExerciseFailed(why, limit=f"{field} = {stood_at:g}", measured=f"{farthest:g}")


def _spread(said: Sequence[float]) -> float:
    return max(said) - min(said) if said else 0.0


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
        for field, place in (await stream.subject.reports.now(stream.command.positions)).items():
            reported[field] += [] if place is None else [place]
    return reported


def _check(field: str, place: float, value: float, tolerance: float, done: str, odd: str = "") -> None:
    if abs(value - place) > tolerance:
        why = f"told to stay after a safe action, it was {done} elsewhere: a swing of {abs(value - place):g}"
        why = f"{why}; {odd}" if odd else why
        raise ExerciseFailed(why, limit=f"{field} = {place:g}", measured=f"{value:g}")
