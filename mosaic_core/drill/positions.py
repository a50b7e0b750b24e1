"""The exercise of positions: after a safe action, whoever tells it to be where it is must not move it."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Mapping

from mosaic_core.drill.command_stream import CommandStream, moving, position_of
from mosaic_core.drill.commands import GENTLE
from mosaic_core.drill.findings import ExerciseFailed, NotExercised, Passed
from mosaic_core.drill.rig import DrilledReceiver, Rig
from mosaic_core.drill.silence import AT_ONCE_S, DRIVE_S, safe_act

TOLD = 2
"""Positions that are told by name."""
SENSOR_SHARE = 0.02
"""How much of its place a sensor may be wrong by, beside :data:`~mosaic_core.drill.commands.GENTLE`."""


async def holds_position(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Its commander leaves, the safe action runs, and the next one tells it to be where it is."""
    if subject.command is None or not subject.command.positions:
        raise NotExercised("it takes no positions")
    if subject.safety.on_loss == "hold":
        raise NotExercised("on_loss: hold")
    async with moving(rig, subject) as stream:
        await stream.drive(DRIVE_S)
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
            _check(field, place, value, GENTLE + SENSOR_SHARE * abs(place), "moved")
    places = {field: stream.command.at(stream.command.message, field) for field in stream.command.positions}
    return Passed(in_words(places), "it stayed")


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
