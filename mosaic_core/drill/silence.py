"""Exercises of loss: silence, a cut link, a good-bye, a picture that stands still, a holder who is gone."""

from __future__ import annotations

import asyncio
import time

from mosaic_core.contract.handler import has_safe_action
from mosaic_core.drill.command_stream import BEGIN_S, CommandStream, in_background, moving, opened
from mosaic_core.drill.findings import TOLERANCE_S, ExerciseFailed, NotExercised, Passed, in_time
from mosaic_core.drill.recorder import Act
from mosaic_core.drill.rig import DrilledReceiver, Rig, comes_true
from mosaic_core.words.control import PEER_LOST_AFTER_S

AT_ONCE_S = 0.05
"""What has no limit of its own must happen within a few turns of the robot's loop."""
DRIVE_S = 0.3
WAIT_S = 1.0
"""Longer than the limit, to see how late it was."""
PICTURE_PERIOD_S = 0.1
SILENCE = "safety.timeout"
_AT_LEAST = 0.5
"""Of the limit."""


async def safe_action(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Nothing is run: whether its author wrote a safe action at all."""
    if subject.safety.on_timeout == "hold":
        raise NotExercised("on_timeout: hold, so that nothing is done on purpose")
    if has_safe_action(type(subject.handler)):
        return Passed("make_safe", "make_safe")
    if subject.safety.on_timeout == "zero" and subject.command is not None and subject.command.fields:
        return Passed("make_safe", "zeros")
    raise ExerciseFailed(
        "make_safe is not written: silence would be noticed, and nothing done", limit="make_safe", measured="none"
    )


async def silence(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The operator stays, and says nothing more."""
    limit_s = subject.safety.timeout_s
    if limit_s is None:
        raise NotExercised("no time-out (`safety.timeout_s`)")
    if subject.safety.on_timeout == "hold":
        raise NotExercised("on_timeout: hold")
    async with moving(rig, subject) as stream:
        await stream.drive(DRIVE_S)
        recorder = subject.recorder  # what came while a slow handle_data ran is carried out after it
        await comes_true(lambda: recorder.is_calm(AT_ONCE_S / 2), BEGIN_S)
        began_s = 0.0
        while recorder.began_at_s > began_s:  # on a busy machine the last one may not have been taken yet
            began_s = recorder.began_at_s
            await _safe_after(subject, began_s, limit_s)
        return await _made_safe(stream, began_s, limit_s, SILENCE, at_least_s=limit_s * _AT_LEAST)


async def _safe_after(subject: DrilledReceiver, began_s: float, limit_s: float) -> None:
    """Wait for the safe action of the silence since then: one that comes much sooner waited for the command before."""
    await safe_act(subject, began_s + limit_s * _AT_LEAST, limit_s, SILENCE)


async def disconnect(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The link dies without a word."""
    safety = subject.safety
    timeout_s = safety.timeout_s if safety.on_timeout != "hold" else None
    if timeout_s is None and safety.on_loss == "hold":
        raise NotExercised("on_loss: hold")
    limit_s = PEER_LOST_AFTER_S + WAIT_S / 2 if timeout_s is None else timeout_s
    async with moving(rig, subject) as stream:
        await stream.drive(DRIVE_S)
        stream.who.cut()
        began_s = subject.recorder.began_at_s  # on a busy machine the time-out of the last one may be over by now
        return await _made_safe(stream, began_s, limit_s)


async def leaves(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The operator closes the connection."""
    if subject.safety.on_loss == "hold":
        raise NotExercised("on_loss: hold")
    async with moving(rig, subject) as stream:
        last_s, left_s = subject.recorder.began_at_s, time.monotonic()  # its time-out may be over by now: as above
        await stream.who.connection.close()
        return await _made_safe(stream, left_s, AT_ONCE_S, at_least_s=last_s - left_s)


async def frozen_picture(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The operator drives on by a picture that no longer changes."""
    curves, fields = subject.safety.curves, subject.command.fields if subject.command else ()
    if subject.command and subject.command.positions:
        raise NotExercised("it takes positions, which a bad link slows down but never stops by a zero")
    if not fields:
        raise NotExercised("it has no motion fields that could be slowed down")
    if curves.picture == "off" or curves.picture_ms is None:
        raise NotExercised("`slow_down.picture` is off")
    if not rig.cameras:
        raise NotExercised("the configuration has no camera")
    ends_ms = next((value for value, factor in curves.picture_ms if factor == 0), None)
    if ends_ms is None:
        raise NotExercised("its curve picture_ms never reaches 0")
    async with opened(rig, subject) as stream:
        watching = asyncio.create_task(_watch(stream, rig.cameras[0], is_frozen=False))
        try:
            await stream.until_moving()
            await stream.drive(DRIVE_S)
        finally:
            watching.cancel()
        return await _stands_by_the_picture(stream, rig.cameras[0], ends_ms / 1e3)


async def lease_expiry(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The holder vanishes; somebody else must be able to command."""
    resource = subject.safety.resource
    if resource is None:
        raise NotExercised("it takes commands without a lease")
    watcher = await rig.operator()
    try:
        async with opened(rig, subject) as stream:
            stream.who.cut()
            began_s = time.monotonic()
            is_free = await comes_true(
                lambda: watcher.control.leases[resource].holder is None, rig.lease_expiry_s + WAIT_S
            )
            if not is_free:
                raise ExerciseFailed("the lease was not freed", limit=f"{rig.lease_expiry_s * 1e3:.0f} ms")
            return in_time(time.monotonic() - began_s, rig.lease_expiry_s)
    finally:
        await rig.dismiss(watcher)


async def _watch(stream: CommandStream, camera: str, *, is_frozen: bool) -> None:
    """Report fresh pictures of a camera for ever, or the same one."""
    began_s = time.monotonic()
    stream.who.connection.media(camera)
    while True:
        captured_s = began_s if is_frozen else time.monotonic()
        stream.who.control.picture_seen(camera, int(captured_s * 1e6))
        await asyncio.sleep(PICTURE_PERIOD_S)


async def _stands_by_the_picture(stream: CommandStream, camera: str, limit_s: float) -> Passed:
    frozen_s = time.monotonic()
    falls_s = _fall_time_s(stream.subject)
    watching = asyncio.create_task(_watch(stream, camera, is_frozen=True))
    try:
        async with in_background(stream):
            recorder = stream.subject.recorder

            def stood_at_s() -> float | None:
                acts = recorder.commands_since(frozen_s)
                return next((act.at_s for act in acts if not stream.moves(act)), None)

            await comes_true(stood_at_s, limit_s + falls_s + WAIT_S)
            at_s = stood_at_s()
    finally:
        watching.cancel()
    if at_s is None:
        raise ExerciseFailed("it drove on", limit=f"{limit_s * 1e3:.0f} ms")
    return in_time(at_s - frozen_s, limit_s + falls_s + stream.period_s)


def _fall_time_s(subject: DrilledReceiver) -> float:
    """How long its slew limits let it take to stand."""
    command = subject.command
    if command is None or not command.moved:
        return 0.0
    rates = [
        limit.max_fall_per_s
        for limit in subject.safety.limits
        if limit.max_fall_per_s is not None and command.moved in limit.fields
    ]
    return abs(command.at(command.message, command.moved)) / min(rates) if rates else 0.0


async def _made_safe(
    stream: CommandStream, since_s: float, limit_s: float, cause: str = "", at_least_s: float = 0.0
) -> Passed:
    """How long after ``since_s``, and no sooner than ``at_least_s`` (below zero: it may have been before), the safe
    action had returned; and nothing moved it again."""
    safe = await safe_act(stream.subject, since_s + at_least_s, limit_s, cause)
    await asyncio.sleep(TOLERANCE_S / 2)
    if any(stream.moves(act) for act in stream.subject.recorder.commands_after_safe(cause)):
        raise ExerciseFailed("it was moved again after its safe action")
    return in_time(max(0.0, safe.at_s - since_s), limit_s, why=safe.cause)


async def safe_act(subject: DrilledReceiver, since_s: float, limit_s: float, cause: str = "") -> Act:
    """The first safe action that returned after ``since_s``; raises :class:`ExerciseFailed` if none did. Where somebody
    drives on, only that of its ``cause`` counts: a time-out between two commands is no stop."""
    recorder = subject.recorder
    await comes_true(lambda: recorder.safe_since(since_s, cause), limit_s + WAIT_S)
    safe = recorder.safe_since(since_s, cause)
    if safe is None:
        broken = next((act.cause for act in recorder.acts if act.kind == "failed" and act.at_s >= since_s), "")
        why = f"the safe action raised: {broken}" if broken else "the safe action did not run, or did not return"
        raise ExerciseFailed(why, limit=f"{limit_s * 1e3:.0f} ms")
    return safe
