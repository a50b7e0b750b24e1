"""The safety envelope and the link, end to end in memory: what a receiver gets to see of a command."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, ClassVar

import pytest
from support.connectors import Camera, Motor

from mosaic_core import Message
from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.words import control
from mosaic_core.words.data_type import Delivery


class Base(Motor):
    """Its speed has limits, and whoever commands it holds the lease."""

    motion_fields: ClassVar[tuple[str, ...]] = ("v",)

    def __init__(self) -> None:
        super().__init__(requires_lease=True)


@asynccontextmanager
async def played(kit: Any, base: Any, safety: dict[str, Any]) -> AsyncIterator[Any]:
    """``scene, ann, drive``: Ann holds the lease, ``drive(v)`` commands."""
    driven = kit.connector_of(base, safety=safety, delivery=Delivery.RELIABLE)
    async with kit.running(driven, kit.connector_of(Camera("front"))) as scene:
        ann = await scene.enters("ann")
        await ann.take()
        channel = ann.open("drive")
        yield scene, ann, lambda v: channel.say({"v": v}, epoch=ann.epoch)


async def test_a_field_is_clamped_and_rises_no_faster_than_it_may(kit: Any) -> None:
    base = Base()

    # nobody answers pings here: the link would slow it down
    safety = {"limits": {"v": {"max": 0.5, "max_rise_per_s": 1.0}}, "slow_down": "off"}
    async with played(kit, base, safety) as (_scene, ann, drive):
        drive(5.0)
        await kit.until(lambda: base.log)
        first = base.log[0]
        assert first == pytest.approx(0.1)  # one step of a command loop at 1.0 per second
        while base.log[-1] < 0.5:
            drive(5.0)
            await asyncio.sleep(0.02)
        assert max(base.log) == 0.5
        ann.stop()
        ann.say(control.StopClear())
        await kit.until(lambda: "safety.stop" in base.log and not ann.heard("stop.state")[-1].is_stopped)
        drive(5.0)
        await kit.until(lambda: "safety.release_first" in ann.codes())
        drive(0.0)
        await kit.until(lambda: base.log[-1] == 0.0)
        drive(5.0)
        await kit.until(lambda: base.log[-1] > 0.0)
        assert base.log[-1] <= 0.1 + 1e-9  # from a standstill again


async def test_what_is_no_number_where_one_is_limited_is_refused(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {}) as (scene, ann, drive):
        for wrong in ("fast", None, True, [1], {"x": 1}):
            drive(wrong)
        await kit.until(lambda: scene.robot.snapshot().connectors[0].refused == 5)
        assert set(ann.codes()) == {"safety.out_of_range"}
        assert base.log == []


async def test_more_commands_than_allowed_are_refused(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {"max_rate_hz": 10}) as (scene, ann, drive):
        for number in range(1, 31):
            drive(float(number))
        await kit.until(lambda: "safety.too_fast" in ann.codes())
        await kit.until(lambda: len(base.log) + scene.robot.snapshot().connectors[0].refused == 30)
        assert 2 <= len(base.log) <= 6


async def test_zeros_are_handed_over_for_a_second_and_then_accepted_in_silence(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {"timeout_s": 0.5, "slow_down": "off"}) as (scene, ann, drive):
        drive(1.0)
        end_s = time.monotonic() + 1.5
        while time.monotonic() < end_s:
            drive(0.0)
            await asyncio.sleep(0.05)
        assert base.log[0] == 1.0
        handed = len(base.log)
        assert handed < 26  # 21 in a second, and some room for a slow machine
        drive(0.0)
        await kit.until(lambda: scene.robot.snapshot().connectors[0].messages > handed + 3)
        assert len(base.log) == handed
        assert ann.codes() == []
        drive(0.5)
        await kit.until(lambda: base.log[-1] == 0.5)
        assert "safety.timeout" not in base.log


async def test_a_picture_that_stands_still_slows_down_to_nothing(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {"slow_down": {"rtt_ms": "off"}}) as (scene, ann, drive):
        drive(1.0)
        await kit.until(lambda: base.log == [1.0])
        ann.say(control.MediaWatch(label="front", on=True))
        ann.say(control.MediaSeen(label="front", capture_us=int((time.monotonic() - 0.6) * 1e6)))
        drive(1.0)
        await kit.until(lambda: len(base.log) == 2)
        assert 0.3 < base.log[1] <= 0.5
        limit = await ann.hears("safety.limit")
        assert limit.label == "drive"
        assert limit.causes[0].cause == "picture"
        await kit.until(lambda: ann.heard("safety.limit")[-1].factor == 0.0)
        drive(1.0)
        await kit.until(lambda: base.log[-1] == 0.0)
        assert scene.robot.snapshot().connectors[0].limit_factor == 0.0
        ann.say(control.MediaWatch(label="front", on=False))
        drive(1.0)
        await kit.until(lambda: base.log[-1] == 1.0)


async def test_a_picture_that_nobody_watches_limits_nothing(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {"slow_down": {"rtt_ms": "off"}}) as (_scene, ann, drive):
        for label in ("front", "drive", "nothing"):
            ann.say(control.MediaSeen(label=label, capture_us=1))
        drive(1.0)
        await kit.until(lambda: base.log == [1.0])


async def test_where_a_picture_is_required_nothing_moves_without_one(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {"slow_down": {"rtt_ms": "off", "picture": "required"}}) as (_scene, _ann, drive):
        drive(1.0)
        await kit.until(lambda: base.log == [0.0])


async def test_the_robot_pings_and_unanswered_pings_slow_down(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {}) as (_scene, ann, drive):
        await kit.until(lambda: ann.stops.heard("ping"))
        assert ann.heard("ping") == []
        ann.stops.say(control.Pong(t0=ann.stops.heard("ping")[-1].t0, t1=0, t2=0))
        drive(1.0)
        await kit.until(lambda: base.log == [1.0])
        ann.say(control.LeaseKeep(epochs={"motion": ann.epoch}))
        await kit.until(lambda: ann.heard("safety.limit") and ann.heard("safety.limit")[-1].factor < 0.7)
        assert ann.heard("safety.limit")[-1].causes[0].cause == "rtt"
        drive(1.0)
        await kit.until(lambda: len(base.log) == 2)
        assert base.log[1] < 0.7


async def test_one_lost_ping_hardly_slows_down(kit: Any) -> None:
    base = Base()

    async with played(kit, base, {}) as (_scene, ann, _drive):
        for number in range(12):
            await kit.until(lambda wanted=number: len(ann.stops.heard("ping")) > wanted)
            if number != 6:
                ann.stops.say(control.Pong(t0=ann.stops.heard("ping")[number].t0, t1=0, t2=0))
        causes = [cause for limit in ann.heard("safety.limit") for cause in limit.causes if cause.cause == "rtt"]
        assert all(cause.factor > 0.6 for cause in causes)


async def test_lost_commands_slow_down(kit: Any) -> None:
    base = Base()

    connectors = kit.connector_of(base, safety={"slow_down": {"rtt_ms": "off"}}, delivery=Delivery.RELIABLE)
    async with kit.running(connectors) as scene:
        ann = await scene.enters("ann")
        epoch = await ann.take()
        drive = ann.open("drive")
        drive.say({"v": 1.0}, seq=1, epoch=epoch)
        await kit.until(lambda: base.log == [1.0])
        for number in range(1, 41):  # every second one is lost
            drive.say({"v": 1.0}, seq=2 * number, epoch=epoch)
        await kit.until(lambda: len(base.log) == 41)
        assert base.log[-1] < 0.3
        assert (await ann.hears("safety.limit")).causes[0].cause == "loss"


class Twist(Message):
    v: float
    mode: str = "walk"


class Typed(DataChannelReceivable[Twist]):
    timeout_s = 0.5
    motion_fields: ClassVar[tuple[str, ...]] = ("v",)

    def __init__(self) -> None:
        super().__init__("drive")
        self.log: list[Any] = []
        self.free = threading.Event()
        self.free.set()

    def handle_data(self, data: Twist) -> None:
        self.log.append((data.v, data.mode))

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)


async def test_the_policy_zero_sends_zeros_for_a_second_after_the_safe_action(kit: Any) -> None:
    base = Typed()

    async with played(kit, base, {"on_timeout": "zero", "slow_down": "off"}) as (scene, ann, _drive):
        ann.open("drive").say({"v": 1.0, "mode": "trot"})
        await kit.until(lambda: len(base.log) >= 6)
        assert base.log[:2] == [(1.0, "trot"), "safety.timeout"]
        assert set(base.log[2:]) == {(0.0, "trot")}
        await asyncio.sleep(1.2)
        assert 8 <= len(base.log[2:]) <= 12
        assert scene.robot.snapshot().connectors[0].messages == 1


class Sticky(Typed):
    """Its safe action fails the first time."""

    def make_safe(self, cause: str) -> None:
        super().make_safe(cause)
        if self.log.count(cause) == 1:
            raise OSError("the bus is busy")


async def test_the_policy_zero_sends_zeros_also_when_the_safe_action_works_only_at_the_second_try(kit: Any) -> None:
    base = Sticky()

    async with played(kit, base, {"on_timeout": "zero", "slow_down": "off"}) as (_scene, ann, _drive):
        ann.open("drive").say({"v": 1.0})
        await kit.until(lambda: (0.0, "walk") in base.log)
        assert base.log[:3] == [(1.0, "walk"), "safety.timeout", "safety.timeout"]


async def test_the_frameworks_zeros_end_with_the_next_command_and_with_a_stop(kit: Any) -> None:
    base = Typed()

    async with played(kit, base, {"on_timeout": "zero", "slow_down": "off"}) as (_scene, ann, _drive):
        channel = ann.open("drive")
        channel.say({"v": 1.0})
        await kit.until(lambda: (0.0, "walk") in base.log)
        channel.say({"v": 2.0})
        await kit.until(lambda: (2.0, "walk") in base.log)
        after = base.log[base.log.index((2.0, "walk")) + 1 :]
        assert (0.0, "walk") not in after
        await kit.until(lambda: base.log[-1] == (0.0, "walk"))
        ann.stop()
        await kit.until(lambda: "safety.stop" in base.log)
        stopped = base.log.index("safety.stop")
        await asyncio.sleep(0.3)
        # a zero that was under way when the stop came is made safe once more; after that nothing is sent
        assert [entry for entry in base.log[stopped:] if entry != "safety.stop"] in ([], [(0.0, "walk")])


async def test_the_policy_hold_does_nothing_on_silence_but_a_stop_still_stops(kit: Any) -> None:
    base = Typed()

    async with played(kit, base, {"on_timeout": "hold", "on_loss": "callback"}) as (_scene, ann, _drive):
        channel = ann.open("drive")
        channel.say({"v": 1.0})
        await kit.until(lambda: len(base.log) == 1)
        await asyncio.sleep(0.8)
        assert base.log == [(1.0, "walk")]
        channel.close()  # its link is lost: on_loss says otherwise
        await kit.until(lambda: base.log == [(1.0, "walk"), "safety.peer_left"])
        ann.stop()
        await kit.until(lambda: base.log[-1] == "safety.stop")


async def test_a_refused_command_leaves_the_slew_where_it_was(kit: Any) -> None:
    class Picky(Base):
        def handle_data(self, data: dict[str, Any]) -> None:
            if data.get("bad"):
                raise Refused("channel.invalid", "not this one")
            super().handle_data(data)

    base = Picky()

    safety = {"limits": {"v": {"max_rise_per_s": 1.0}}}
    async with kit.running(kit.connector_of(base, safety=safety, delivery=Delivery.RELIABLE)) as scene:
        ann = await scene.enters("ann")
        epoch = await ann.take()
        drive = ann.open("drive")
        for _ in range(10):
            drive.say({"v": 5.0, "bad": True}, epoch=epoch)
        drive.say({"v": 5.0}, epoch=epoch)
        await kit.until(lambda: base.log)
        assert base.log[0] == pytest.approx(0.1)
