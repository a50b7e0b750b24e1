"""One driver carries out every machine: events, effects in their order, deadlines that move, and an end."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable

from mosaic_core.machines.timing.deadline import DeadlinePassed
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.timing.machine_driver import MachineDriver

LONG_S = 3600.0


class Echo:
    """Answers each event with itself twice; ``wait S`` sets the deadline that many seconds ahead."""

    def __init__(self, deadline_s: float | None = None) -> None:
        self.deadline_s = deadline_s

    def handle(self, event: str | DeadlinePassed, now_s: float) -> Iterable[str]:
        if isinstance(event, DeadlinePassed):
            self.deadline_s = None
            return ["passed"]
        words = event.split()
        self.deadline_s = now_s + float(words[1]) if words[0] == "wait" else None
        return [event, event]


async def test_effects_are_carried_out_in_order_and_what_they_tell_comes_before_the_next_one() -> None:
    carried: list[str] = []

    def carry_out(effect: str) -> None:
        carried.append(effect)
        if effect == "first" and len(carried) == 1:
            driver.tell("inner")

    driver = MachineDriver(Echo(), carry_out)
    driver.tell("first")
    assert carried == ["first", "inner", "inner", "first"]


async def test_the_deadline_is_told_once_it_has_passed() -> None:
    passed = asyncio.Event()
    driver = MachineDriver(Echo(), lambda effect: passed.set() if effect == "passed" else None)
    driver.tell("wait 0")
    async with asyncio.timeout(30):
        await passed.wait()


async def test_a_deadline_from_the_beginning_counts_once_the_driver_is_started() -> None:
    passed = asyncio.Event()
    MachineDriver(Echo(deadline_s=0.0), lambda _: passed.set()).start()
    async with asyncio.timeout(30):
        await passed.wait()


async def test_a_later_event_takes_the_old_deadline_back() -> None:
    carried: list[str] = []
    driver = MachineDriver(Echo(), carried.append)
    driver.tell("wait 0")
    driver.tell(f"wait {LONG_S}")
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert "passed" not in carried
    driver.stop()


async def test_a_stopped_driver_watches_nothing() -> None:
    carried: list[str] = []
    driver = MachineDriver(Echo(), carried.append)
    driver.tell("wait 0")
    driver.stop()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert carried == ["wait 0", "wait 0"]


async def test_one_that_its_own_effect_stops_carries_out_nothing_more_and_takes_nothing() -> None:
    carried: list[str] = []

    def carry_out(effect: str) -> None:
        carried.append(effect)
        driver.stop()

    driver = MachineDriver(Echo(), carry_out)
    driver.tell("wait 0")
    driver.tell("later")
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert carried == ["wait 0"]


async def test_a_timer_fires_once_and_can_be_set_again_from_its_own_callback() -> None:
    fired = 0
    twice = asyncio.Event()

    def fire() -> None:
        nonlocal fired
        fired += 1
        if fired == 1:
            timer.set(0.0)
        else:
            twice.set()

    timer = DeadlineTimer(fire)
    timer.set(0.0)
    async with asyncio.timeout(30):
        await twice.wait()
    timer.set(0.0)
    timer.set(None)
    await asyncio.sleep(0)
    assert fired == 2


async def test_tasks_are_kept_until_they_are_done_also_those_they_start() -> None:
    tasks, done = BackgroundTasks(), []

    async def inner() -> None:
        done.append("inner")

    async def outer() -> None:
        await asyncio.sleep(0)
        tasks.start(inner())
        done.append("outer")

    tasks.start(outer())
    await tasks.done()
    assert done == ["outer", "inner"]


async def test_a_task_may_cancel_all_others_without_ending_itself() -> None:
    tasks, done = BackgroundTasks(), []

    async def waits() -> None:
        await asyncio.Event().wait()

    async def ends_all() -> None:
        tasks.cancel()
        await asyncio.sleep(0)
        done.append("ended all")

    waiting = tasks.start(waits())
    tasks.start(ends_all())
    await tasks.done()
    assert waiting.cancelled()
    assert done == ["ended all"]
