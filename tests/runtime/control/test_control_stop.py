"""The stop on the robot, end to end in memory: from anybody, at once, latched, acknowledged, cleared on purpose."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.connectors import Motor

from mosaic_core.runtime.commands import safety_watch
from mosaic_core.runtime.handlers import routes
from mosaic_core.words import control
from mosaic_core.words.data_type import Delivery

PATIENCE_S = 3.0


@asynccontextmanager
async def played(kit: Any, motors: list[Motor], delivery: Delivery | None = None, **control: Any) -> AsyncIterator[Any]:
    async with kit.running(*(kit.connector_of(motor, delivery=delivery) for motor in motors), control=control) as scene:
        try:
            yield scene
        finally:
            for motor in motors:
                motor.free.set()
                motor.may_stop.set()


@pytest.mark.parametrize("role", ["observer", "operator", "supervisor"])
async def test_anybody_stops_everything_that_moves_also_what_was_never_commanded(kit: Any, role: str) -> None:
    leased = Motor("leased", timeout_s=None, requires_lease=True)
    timed, lamp = Motor("timed"), Motor("lamp", timeout_s=None)

    async with played(kit, [leased, timed, lamp]) as scene:
        eve, ann = await scene.enters("eve", role=role), await scene.enters("ann")
        eve.stop(reason="somebody is in the way")
        ack = await eve.stops_ack()
        assert ack.id == "s1"
        await kit.until(lambda: eve.stops.heard("stop.ack")[-1].safe_us is not None)
        safe = eve.stops.heard("stop.ack")[-1]
        assert safe.safe_us >= safe.received_us
        assert leased.log == timed.log == ["safety.stop"]
        assert lamp.log == []
        state = ann.heard("stop.state")[-1]
        assert (state.is_stopped, state.by, state.reason) == (True, "eve", "somebody is in the way")
        assert scene.robot.snapshot().stop.by == "eve"
        assert scene.hooks.of("stop") == [{"is_stopped": True, "by": "eve", "reason": "somebody is in the way"}]


async def test_while_stopped_nothing_moves_and_what_moves_nothing_goes_on(kit: Any) -> None:
    motor, lamp = Motor("motor"), Motor("lamp", timeout_s=None)

    async with played(kit, [motor, lamp]) as scene:
        ann = await scene.enters("ann")
        channels = ann.open("motor"), ann.open("lamp")
        ann.stop()
        await kit.until(lambda: motor.log == ["safety.stop"])
        for channel in channels:
            channel.say({"v": 1})
        await kit.until(lambda: lamp.log == [1] and ann.codes() == ["safety.stopped"])
        assert motor.log == ["safety.stop"]


async def test_a_stop_while_handle_data_hangs_acts_at_once_and_again_when_it_returns(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safety_watch, "RESTOP_S", 60.0)  # what it does meanwhile, again and again, has its own test
    motor = Motor("motor")

    async with played(kit, [motor]) as scene:
        ann = await scene.enters("ann")
        motor.free.clear()
        ann.open("motor").say({"v": 1})
        await kit.until(lambda: motor.log == [1])
        ann.stop()
        await kit.until(lambda: [ack for ack in ann.stops.heard("stop.ack") if ack.safe_us is not None])
        assert motor.log == [1, "safety.stop"]
        motor.free.set()
        await kit.until(lambda: motor.log == [1, "safety.stop", "safety.stop"])


async def test_what_waits_in_a_full_queue_never_acts_not_even_after_the_stop_is_cleared(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(routes, "PAUSE_S", 0.1)
    motor = Motor("motor", timeout_s=None, requires_lease=True)

    async with played(kit, [motor], Delivery.RELIABLE, lease_expiry_s=60.0) as scene:  # nobody keeps the lease here
        ann = await scene.enters("ann")
        drive, epoch = ann.open("motor"), await ann.take()
        motor.free.clear()
        for number in range(600):
            drive.say({"v": number}, epoch=epoch)
        await kit.until(lambda: motor.log == [0] and "channel.queue_full" in ann.codes())
        ann.stop()
        ann.say(control.StopClear())
        await kit.until(lambda: ann.heard("stop.state")[-1].is_stopped is False and len(ann.heard("stop.state")) == 3)
        motor.free.set()
        await kit.until(lambda: motor.log.count("safety.stop") >= 2)
        drive.say({"v": "goes on"}, epoch=epoch)
        await kit.until(lambda: "safety.release_first" in ann.codes())
        await asyncio.sleep(0.1)
        drive.say({"v": "held up by the link"}, epoch=epoch, age_s=0.1)
        await kit.until(lambda: ann.codes().count("safety.release_first") == 2)
        await asyncio.sleep(0.1)  # it moves nothing that one could send a zero of: only a pause is letting go
        drive.say({"v": "after"}, epoch=epoch)
        await kit.until(lambda: motor.log[-1] == "after")
        assert (motor.log[0], set(motor.log[1:-1])) == (0, {"safety.stop"})


async def test_the_acknowledgement_does_not_wait_for_a_safe_action_that_hangs(kit: Any) -> None:
    slow, quick = Motor("slow"), Motor("quick")

    async with played(kit, [slow, quick]) as scene:
        ann = await scene.enters("ann")
        slow.may_stop.clear()
        ann.stop("first")
        assert (await ann.stops_ack()).safe_us is None
        await kit.until(lambda: quick.log == ["safety.stop"])
        ann.say(control.Stop(id="second"))
        assert (await ann.hears("stop.ack")).safe_us is None
        slow.may_stop.set()
        await kit.until(lambda: ann.stops.heard("stop.ack")[-1].safe_us is not None)
        await kit.until(lambda: ann.heard("stop.ack")[-1].safe_us is not None)
        assert {ack.id for ack in ann.stops.heard("stop.ack")} == {"first"}
        assert {ack.id for ack in ann.heard("stop.ack")} == {"second"}


async def test_a_safe_action_that_fails_is_repeated_before_the_robot_calls_itself_safe(kit: Any) -> None:
    class Flaky(Motor):
        def make_safe(self, cause: str) -> None:
            super().make_safe(cause)
            if len(self.log) < 3:
                raise OSError("the bus is busy")

    motor = Flaky("motor")

    async with played(kit, [motor]) as scene:
        ann = await scene.enters("ann")
        ann.stop()
        await kit.until(lambda: ann.stops.heard("stop.ack") and ann.stops.heard("stop.ack")[-1].safe_us is not None)
        assert motor.log == ["safety.stop"] * 3


async def test_copies_of_a_stop_are_all_acknowledged_and_act_once(kit: Any) -> None:
    motor = Motor("motor")

    async with played(kit, [motor]) as scene:
        ann = await scene.enters("ann")
        for _ in range(5):
            ann.stop("s1")
        ann.stop("s2")
        await kit.until(lambda: [ack.id for ack in ann.stops.heard("stop.ack")].count("s1") >= 5)
        await kit.until(lambda: "s2" in [ack.id for ack in ann.stops.heard("stop.ack")])
        await kit.until(lambda: motor.log == ["safety.stop"])
        assert len(scene.hooks.of("stop")) == 1


async def test_only_a_person_with_a_lease_or_a_supervisor_clears_it(kit: Any) -> None:
    motor = Motor("motor", requires_lease=True)

    async with played(kit, [motor]) as scene:
        ann, bob = await scene.enters("ann"), await scene.enters("bob")
        bot, boss = await scene.enters("bot", is_person=False), await scene.enters("boss", role="supervisor")
        for who, code in ((bob, "lease.required"), (bot, "safety.person_clears")):
            ann.stop()
            await kit.until(lambda: ann.heard("stop.state")[-1].is_stopped)
            who.say(control.StopClear())
            await kit.until(lambda who=who, code=code: who.codes() == [code])
            assert who.heard("refusal")[-1].label == control.STOP_LABEL
        await ann.take()
        for who in (ann, boss):
            ann.stop()
            await kit.until(lambda: ann.heard("stop.state")[-1].is_stopped)
            who.say(control.StopClear())
            await kit.until(lambda: not ann.heard("stop.state")[-1].is_stopped)
            assert ann.heard("stop.state")[-1].by == ("ann" if who is ann else "boss")
        ann.open("motor").say({"v": 1}, epoch=ann.epoch)
        await kit.until(lambda: motor.log[-1] == 1)
        assert scene.robot.snapshot().stop is None


async def test_rubbish_on_the_stop_channel_moves_nothing_and_stops_nothing(kit: Any) -> None:
    motor = Motor("motor")

    async with played(kit, [motor]) as scene:
        ann = await scene.enters("ann")
        assert ann.stops.channel.on_message is not None
        for rubbish in (b"", b"\x00" * 19, "text", b"\xff" * 40, b"\x01" + b"\x00" * 5000):
            ann.stops.channel.on_message(rubbish)
        for text in ("[", "{}", '{"type": "stop"}', '{"type": "stop", "data": {"id": ""}}', '{"type": "hello"}'):
            ann.stops.channel.say(text)
        assert not scene.robot.snapshot().stop
        ann.stop("x" * 64)
        await kit.until(lambda: motor.log == ["safety.stop"])
