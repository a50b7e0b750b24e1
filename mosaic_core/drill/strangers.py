"""Exercises of authority: the stop, a take-over, and commands that must not act, whoever sends them."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from mosaic_core.drill.command_stream import CommandStream, in_background, moving, opened
from mosaic_core.drill.findings import ExerciseFailed, NotExercised, Passed, in_time
from mosaic_core.drill.rig import DrilledReceiver, Rig, comes_true
from mosaic_core.drill.silence import AT_ONCE_S, WAIT_S, safe_act
from mosaic_core.machines.commands.gates import Gate
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.operator import LeaseDenied
from mosaic_core.words.control import CONTROL_LABEL, STOP_LABEL
from mosaic_core.words.limits import FieldLimit

SETTLE_S = 0.15
"""For what was said to be carried out, or not."""


async def stop(rig: Rig, subject: DrilledReceiver) -> Passed:
    """An observer says stop while somebody drives on; of the two channels that take it only its own works."""
    return await _stopped(rig, subject, lost_channel=CONTROL_LABEL)


async def stop_on_control(rig: Rig, subject: DrilledReceiver) -> Passed:
    """The same where only the control channel works."""
    return await _stopped(rig, subject, lost_channel=STOP_LABEL)


async def _stopped(rig: Rig, subject: DrilledReceiver, *, lost_channel: str) -> Passed:
    """Said on both channels, a stop would hide that one of them is broken. It is said while a command is carried out,
    if that takes long enough to be seen. A supervisor clears it afterwards."""
    observer, supervisor = await rig.operator("observer"), await rig.operator("supervisor")
    try:
        async with moving(rig, subject) as stream, in_background(stream):
            observer.lose(lost_channel)
            is_acting = await comes_true(lambda: subject.recorder.is_acting, SETTLE_S)
            began_s = time.monotonic()
            saying = asyncio.create_task(observer.control.stop("safety drill"))
            try:
                with _blaming_a_lock(if_acting=is_acting):
                    safe = await safe_act(subject, began_s, AT_ONCE_S, "safety.stop")
                    passed = in_time(safe.at_s - began_s, AT_ONCE_S)
                if not await comes_true(saying.done, WAIT_S):
                    raise ExerciseFailed("it stood, but whoever said stop was not told")
            finally:
                saying.cancel()
                await asyncio.gather(saying, return_exceptions=True)
            await asyncio.sleep(SETTLE_S)
            if any(stream.moves(act) for act in subject.recorder.commands_after_safe("safety.stop")):
                raise ExerciseFailed("it took commands while it was stopped")
            return replace(passed, gate=stream.who.gates.get("safety.stopped", ""))
    finally:
        await rig.dismiss(observer)  # first: a stop that was not heard is said again and again
        await supervisor.control.clear_stop()
        await rig.dismiss(supervisor)


@contextmanager
def _blaming_a_lock(*, if_acting: bool) -> Iterator[None]:
    """Tell what a safe action that is late has waited for, most likely."""
    try:
        yield
    except ExerciseFailed as failed:
        if not if_acting:
            raise
        why = f"{failed}; handle_data ran meanwhile: make_safe must take no lock that it holds"
        raise ExerciseFailed(why, limit=failed.limit, measured=failed.measured) from None


async def let_go(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Somebody drives on through a stop and its clearing."""
    supervisor = await rig.operator("supervisor")
    try:
        async with moving(rig, subject) as stream, in_background(stream):
            await supervisor.control.stop("safety drill")
            await supervisor.control.clear_stop()
            began_s = time.monotonic()
            if not await stream.who.until_refused("safety.release_first"):
                raise ExerciseFailed("whoever drives on through a stop was not told to let go first")
            await asyncio.sleep(SETTLE_S)
            if any(stream.moves(act) for act in subject.recorder.commands_since(began_s)):
                raise ExerciseFailed("it moved by itself when the stop was cleared")
            code = "safety.release_first"
            return Passed(code, code, gate=stream.who.gates[code])
    finally:
        await rig.dismiss(supervisor)


async def take_over(rig: Rig, subject: DrilledReceiver) -> Passed:
    """A supervisor takes the lease from somebody who drives on; an operator may not."""
    resource = _resource(subject)
    supervisor, other = await rig.operator("supervisor"), await rig.operator()
    try:
        async with moving(rig, subject) as stream, in_background(stream):
            try:
                await other.control.take(resource, force=True, reason="safety drill")
            except LeaseDenied as denied:
                if denied.code != "lease.force_forbidden":
                    raise ExerciseFailed(f"an operator's force was refused with {denied.code}") from None
            else:
                raise ExerciseFailed("an operator who is no supervisor took over by force")
            began_s = time.monotonic()
            await supervisor.control.take(resource, force=True, reason="safety drill")
            safe = await safe_act(subject, began_s, AT_ONCE_S, "safety.lease_lost")
            await asyncio.sleep(SETTLE_S)
            if subject.recorder.commands_after_safe("safety.lease_lost"):
                raise ExerciseFailed("commands of who lost the lease were carried out")
            return in_time(safe.at_s - began_s, AT_ONCE_S)
    finally:
        await rig.dismiss(supervisor, other)


async def stranger(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Somebody else commands while the holder looks on."""
    _resource(subject)
    async with opened(rig, subject), opened(rig, subject, holds=False) as stream:
        return await _refused(stream, Gate.LEASE, "lease.not_holder", stream.say)


async def observer(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Somebody who may only watch commands."""
    if subject.safety.takes_observers:
        raise NotExercised("it takes messages of observers (`takes_observers`)")
    async with opened(rig, subject, "observer", holds=False) as stream:
        return await _refused(stream, Gate.ROLE, "lease.forbidden", stream.say)


async def old_epoch(rig: Rig, subject: DrilledReceiver) -> Passed:
    """A command of a lease that has ended, from the very operator who holds the next one."""
    resource = _resource(subject)
    async with opened(rig, subject) as stream:
        before = stream.epoch
        stream.who.control.release(resource)
        await stream.who.control.take(resource)
        return await _refused(stream, Gate.LEASE, "lease.old_epoch", lambda: stream.say(epoch=before))


async def replay(rig: Rig, subject: DrilledReceiver) -> Passed:
    """A command that was carried out is said again."""
    async with moving(rig, subject) as stream:
        return await _refused(stream, Gate.SEQUENCE, "safety.out_of_order", lambda: stream.say(seq=stream.seq))


async def reordered(rig: Rig, subject: DrilledReceiver) -> Passed:
    """A command arrives after a newer one."""
    async with moving(rig, subject) as stream:
        stream.seq += 1
        stream.say()
        return await _refused(stream, Gate.SEQUENCE, "safety.out_of_order", lambda: stream.say(seq=stream.seq - 1))


async def not_a_number(rig: Rig, subject: DrilledReceiver) -> Passed:
    """NaN where a number belongs."""
    if subject.command is None or subject.command.kind is not PayloadKind.JSON:
        raise NotExercised("its messages are no JSON")
    moved = subject.command.moved
    payload = subject.command.with_value(moved, "NaN") if moved else b'{"drill":NaN}'
    async with moving(rig, subject) as stream:
        return await _refused(stream, Gate.SHAPE, "safety.not_finite", lambda: stream.say(payload))


def _limited(subject: DrilledReceiver) -> list[tuple[str, FieldLimit]]:
    """The fields of its command that may not go further than some number above 0."""
    safety, command = subject.safety, subject.command
    fields = (*command.fields, *command.positions) if command else ()
    its = ((field, limit) for field in fields for limit in safety.limits_on(field))
    return [(field, limit) for field, limit in its if (limit.max or limit.max_norm or 0) > 0]


async def out_of_range(rig: Rig, subject: DrilledReceiver) -> Passed:
    """Far more than the limits allow must arrive limited, or not at all."""
    command = subject.command
    limited = _limited(subject)
    if command is None or not limited:
        raise NotExercised("it has no limits (`safety.limits`)")
    field, limit = limited[0]
    if rig.is_live and limit.kind == "position":
        raise NotExercised("a live drill sends nothing to the end of its range")
    most = min(one for one in (limit.max, limit.max_norm) if one is not None)
    async with moving(rig, subject) as stream:
        began_s = time.monotonic()
        while time.monotonic() - began_s < 2 * SETTLE_S:
            stream.say(command.with_value(field, f"{most * 100:.6g}"))
            await asyncio.sleep(stream.period_s)
        acts = subject.recorder.commands_since(began_s)
        reached = max((abs(command.at(act.value, field)) for act in acts), default=math.nan)
        words = f"{field} ≤ {most:g}"
        if not acts and not stream.who.refusals:
            raise ExerciseFailed("the command was neither carried out nor refused", limit=words)
        if reached > most * (1 + 1e-9):
            raise ExerciseFailed("more than the limit reached the connector", limit=words, measured=f"{reached:g}")
        told = "" if acts else stream.who.refusals[-1]
        return Passed(words, told or f"{reached:g}", gate=stream.who.gates.get(told, Gate.ENVELOPE))


async def too_fast(rig: Rig, subject: DrilledReceiver) -> Passed:
    """A burst of commands."""
    most_hz = subject.safety.max_rate_hz
    if most_hz is None:
        raise NotExercised("no `safety.max_rate_hz`")
    async with moving(rig, subject) as stream:
        for _ in range(int(most_hz) * 2 + 10):
            stream.say()
        if not await stream.who.until_refused("safety.too_fast"):
            raise ExerciseFailed("a burst was taken whole", limit=f"{most_hz:g} Hz")
        return Passed(f"{most_hz:g} Hz", "safety.too_fast", gate=stream.who.gates["safety.too_fast"])


async def _refused(stream: CommandStream, gate: Gate, code: str, say: Callable[[], None]) -> Passed:
    """What ``say()`` sends must be refused at ``gate`` with ``code`` and not be carried out."""
    await asyncio.sleep(SETTLE_S)
    began_s = time.monotonic()
    say()
    was_told = await stream.who.until_refused(code)
    await asyncio.sleep(AT_ONCE_S)
    moved = [act for act in stream.subject.recorder.commands_since(began_s) if stream.moves(act)]
    told = stream.who.refusals[-1] if stream.who.refusals else "nothing"
    if moved:
        raise ExerciseFailed("it was carried out", limit=code, measured="carried out")
    if not was_told:
        raise ExerciseFailed("the sender was not told why", limit=code, measured=told)
    named = stream.who.gates[code]
    if named != gate:
        raise ExerciseFailed("another gate refused it", limit=f"{code} at {gate}", measured=f"{code} at {named}")
    return Passed(code, code, gate=named)


def _resource(subject: DrilledReceiver) -> str:
    if subject.safety.resource is None:
        raise NotExercised("it takes commands without a lease")
    return subject.safety.resource
