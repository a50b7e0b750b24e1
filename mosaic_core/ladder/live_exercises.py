"""Drills what moves on the device that its author has made up: there its own handle_data and make_safe run."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.drill.drill import EXERCISE_S, EXERCISES
from mosaic_core.drill.findings import ExerciseFailed, NotExercised, NothingMoved
from mosaic_core.drill.rig import DrilledReceiver, Rig, rig_of
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.runtime.configuration.auto_configurer import Configured

LIVE = ("stop", "leaves", "silence", "holds-position")
"""The exercises that end one way or another by what a safe action really does."""
ABOUT_TIME = frozenset(("stop", "leaves", "silence"))
"""Those that are tried again before they fail: a busy machine is late once, a lock always."""
DRILLED_TIMEOUT_S = 0.5
"""The longest time-out that the exercises wait for: what a class does after it does not depend on how long it was."""


def hurried(configured: Configured) -> Configured:
    """The same, with short time-outs."""
    for connector in configured.connectors:
        for handler in connector.handlers:
            if isinstance(handler, DataChannelReceivable) and handler.timeout_s is not None:
                with contextlib.suppress(AttributeError):  # a property of its class: the drill waits
                    handler.timeout_s = min(handler.timeout_s, DRILLED_TIMEOUT_S)
    return configured


async def live_failures(one: Examinee) -> list[tuple[type[Any], str]]:
    """``(class, what was wrong)`` for each receiver that did not do what it must; nothing of a connector without a
    ``trial``, whose device may be a real one."""
    if one.configurer.trial is None:
        return []
    found: list[tuple[type[Any], str]] = []
    async with rig_of(hurried(one.configured(one.trial)), live=True) as rig:
        for subject in rig.subjects:
            if subject.safety.is_motion and subject.command is not None:
                wrong = await _first_failure(rig, subject)
                found += [(type(subject.handler), wrong)] if wrong else []
    return found


async def _first_failure(rig: Rig, subject: DrilledReceiver) -> str:
    """What the first exercise tells that it failed; what hangs would fail the others too."""
    for name in LIVE:
        wrong = await _failure(rig, subject, name)
        if wrong and name in ABOUT_TIME:
            wrong = await _failure(rig, subject, name)
        if wrong:
            return wrong
    return ""


async def _failure(rig: Rig, subject: DrilledReceiver, name: str) -> str:
    """What one exercise tells that it failed; nothing where it can't be exercised."""
    try:
        async with asyncio.timeout(EXERCISE_S):
            await EXERCISES[name](rig, subject)
    except NotExercised:
        return ""
    except NothingMoved as still:
        return "" if still.is_refused else f"{name}: {still}"
    except ExerciseFailed as failed:
        figures = f" ({failed.measured} instead of {failed.limit})" if failed.measured else ""
        return f"{name}: {failed}{figures}"
    except TimeoutError:
        return f"{name}: it hung for {EXERCISE_S:.0f} s"
    return ""
