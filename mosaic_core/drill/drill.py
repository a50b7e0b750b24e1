"""Runs the exercises, one after the other, receiver by receiver."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Mapping, Sequence
from dataclasses import asdict, replace

from mosaic_core.drill import positions, silence, strangers
from mosaic_core.drill.findings import DrillFinding, ExerciseFailed, NotExercised, Passed
from mosaic_core.drill.rig import DrilledReceiver, Rig, rig_of
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.words.errors import MosaicError

Exercise = Callable[[Rig, DrilledReceiver], Awaitable[Passed]]
EXERCISE_S = 30.0
"""Something hangs if one exercise takes longer."""
EXERCISES: Mapping[str, Exercise] = {
    "safe-action": silence.safe_action,
    "tells-position": positions.tells_position,
    "silence": silence.silence,
    "disconnect": silence.disconnect,
    "leaves": silence.leaves,
    "frozen-picture": silence.frozen_picture,
    "holds-position": positions.holds_position,
    "stop": strangers.stop,
    "stop-on-control": strangers.stop_on_control,
    "let-go": strangers.let_go,
    "take-over": strangers.take_over,
    "lease-expiry": silence.lease_expiry,
    "stranger": strangers.stranger,
    "observer": strangers.observer,
    "old-epoch": strangers.old_epoch,
    "replay": strangers.replay,
    "reordered": strangers.reordered,
    "not-a-number": strangers.not_a_number,
    "out-of-range": strangers.out_of_range,
    "too-fast": strangers.too_fast,
}
NEEDS_NO_COMMAND = frozenset({"safe-action"})


async def drill(
    configured: Configured,
    *,
    live: bool = False,
    only: Collection[str] = (),
    begun: Callable[[Rig], object] = lambda rig: None,
) -> AsyncIterator[DrillFinding]:
    """Findings as they come. ``only``: names of :data:`EXERCISES`, all by default. ``live`` really drives. ``begun`` is
    told when the robot runs: whoever ends the drill before its time makes it safe first.

    ``configured`` is used up: its handlers are the drill's afterwards.
    """
    names = [name for name in EXERCISES if not only or name in only]
    async with rig_of(configured, live=live) as rig:
        begun(rig)
        for subject in rig.subjects:
            if not subject.safety.is_motion:
                why = "it moves nothing: no time-out, no lease and no motion fields"
                yield DrillFinding("–", subject.label, "skipped", why=why)
                continue
            async for finding in _findings_of(rig, subject, names):
                yield finding


async def _findings_of(rig: Rig, subject: DrilledReceiver, names: Sequence[str]) -> AsyncIterator[DrillFinding]:
    """What keeps every exercise from a receiver is told by the first one, and once."""
    for left, name in enumerate(names, 1 - len(names)):
        finding = await _exercised(rig, subject, name)
        is_last = bool(subject.reports.trouble or (subject.command is None and name not in NEEDS_NO_COMMAND))
        more = "; nothing else of it is exercised" if is_last and left else ""
        yield replace(finding, why=finding.why + more)
        if is_last:
            return


async def _exercised(rig: Rig, subject: DrilledReceiver, name: str) -> DrillFinding:
    if subject.command is None and name not in NEEDS_NO_COMMAND:
        return DrillFinding(name, subject.label, "skipped", why=subject.no_command)
    try:
        async with asyncio.timeout(EXERCISE_S):
            passed = await EXERCISES[name](rig, subject)
    except NotExercised as reason:
        return DrillFinding(name, subject.label, "skipped", why=str(reason))
    except ExerciseFailed as failed:
        return DrillFinding(name, subject.label, "failed", failed.limit, failed.measured, str(failed))
    except MosaicError as error:
        return DrillFinding(name, subject.label, "failed", why=f"{error.code}: {error.message}")
    except TimeoutError:
        return DrillFinding(name, subject.label, "failed", why=f"it hung for {EXERCISE_S:.0f} s")
    return DrillFinding(name, subject.label, "passed", **asdict(passed))
