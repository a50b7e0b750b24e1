"""Who hashes next, who is refused and who leaves the line, with work that ends when the test says so."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections import Counter
from collections.abc import AsyncIterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_server.security.hashing_line import (
    HASHING_AT_ONCE,
    MOST_IN_LINE,
    MOST_WAITING,
    NICENESS,
    HashingLine,
    LineTooLong,
)


async def settled() -> None:
    """Whoever was called, cancelled or refused has heard of it."""
    for _ in range(10):
        await asyncio.sleep(0)


class Hall:
    """A line, and what those in it did. Nobody who has a turn ends it before :meth:`open`."""

    def __init__(self) -> None:
        self.line = HashingLine()
        self.began: list[str] = []
        self.refused: list[tuple[str, LineTooLong]] = []
        self.inside: Counter[str] = Counter()
        self.most_inside = self.most_of_one = 0
        self.tasks: list[asyncio.Task[None]] = []
        self._free = asyncio.Event()

    def open(self) -> None:
        self._free.set()

    async def comes(self, who: str, times: int = 1) -> None:
        """They stand in the line when this returns."""
        self.tasks += [asyncio.create_task(self._hashes(who)) for _ in range(times)]
        await settled()

    async def _hashes(self, who: str) -> None:
        try:
            async with self.line.turn(who):
                self.began.append(who)
                self.inside[who] += 1
                self.most_inside = max(self.most_inside, self.inside.total())
                self.most_of_one = max(self.most_of_one, *self.inside.values())
                try:
                    await self._free.wait()
                    await asyncio.sleep(0)
                finally:
                    self.inside[who] -= 1
        except LineTooLong as error:
            self.refused.append((who, error))

    async def end(self) -> None:
        self.open()
        await asyncio.gather(*self.tasks, return_exceptions=True)


@pytest.fixture
async def hall() -> AsyncIterator[Hall]:
    hall = Hall()
    yield hall
    await hall.end()
    hall.line.close()


async def test_thirty_log_ins_of_one_address_are_one_ahead_of_anybody_else(hall: Hall) -> None:
    await hall.comes("crowd", 30)
    await hall.comes("single")
    assert hall.began == ["crowd", "single"]


async def test_addresses_take_turns(hall: Hall) -> None:
    for who in ("a", "b", "c"):
        await hall.comes(who, 3)
    await hall.end()
    assert hall.began[:6] in (["a", "b", "c", "a", "b", "c"], ["a", "b", "c", "b", "a", "c"])
    assert (hall.most_inside, hall.most_of_one) == (HASHING_AT_ONCE, 1)


async def test_an_address_with_too_many_is_refused_at_once_and_told_when_to_come_again(hall: Hall) -> None:
    await hall.comes("crowd", 1 + MOST_WAITING)
    assert hall.refused == []
    await hall.comes("crowd")
    ((_, error),) = hall.refused
    assert error.is_of_address
    assert 1 <= error.retry_after_s <= 2 * MOST_WAITING
    await hall.comes("single")
    assert hall.began == ["crowd", "single"]


async def test_in_a_full_line_the_newest_of_the_longest_makes_room(hall: Hall) -> None:
    for crowd in range(MOST_IN_LINE // MOST_WAITING):
        await hall.comes(f"crowd {crowd}", MOST_WAITING)
    await hall.comes("busy", 2)  # the places of the two who hash meanwhile
    assert hall.refused == []
    await hall.comes("single")
    ((evicted, error),) = hall.refused
    assert evicted.startswith("crowd")
    assert not error.is_of_address


async def test_where_everybody_waits_once_the_next_is_refused_at_once(hall: Hall) -> None:
    for number in range(HASHING_AT_ONCE + MOST_IN_LINE):
        await hall.comes(f"person {number}")
    assert hall.refused == []
    await hall.comes("one more")
    ((who, error),) = hall.refused
    assert (who, error.is_of_address) == ("one more", False)


async def test_whoever_goes_leaves_the_line(hall: Hall) -> None:
    await hall.comes("crowd", 1 + MOST_WAITING)
    for task in hall.tasks[1:]:
        task.cancel()
    await asyncio.gather(*hall.tasks[1:], return_exceptions=True)
    await hall.comes("crowd", MOST_WAITING)
    assert hall.refused == []
    assert hall.began == ["crowd"]


async def test_whoever_goes_in_the_moment_of_the_turn_gives_it_to_the_next(hall: Hall) -> None:
    await hall.comes("first")
    await hall.comes("second")
    await hall.comes("third", 2)
    hall.open()
    for _ in range(10):
        await asyncio.sleep(0)
        hall.tasks[2].cancel()
    await settled()
    assert hall.began == ["first", "second", "third"]


@given(st.data())
async def test_in_any_order_of_coming_and_going_two_hash_and_one_of_each_and_nobody_is_forgotten(
    data: st.DataObject,
) -> None:
    hall = Hall()
    gone = 0
    for _ in range(data.draw(st.integers(1, 25), label="steps")):
        if hall.tasks and data.draw(st.booleans(), label="goes"):
            place = data.draw(st.integers(0, len(hall.tasks) - 1))
            gone += hall.tasks[place].cancel()
            await settled()
        else:
            await hall.comes(data.draw(st.sampled_from("abc")))
        waiting = len(hall.tasks) - sum(task.done() for task in hall.tasks) - hall.inside.total()
        others = {who for who in "abc" if not hall.inside[who]} & set(hall.line._waiting)
        assert hall.inside.total() == HASHING_AT_ONCE or not waiting or not others, "nobody waits before a free thread"
    await hall.end()
    hall.line.close()
    assert hall.most_inside <= HASHING_AT_ONCE
    assert hall.most_of_one <= 1
    assert sum(task.cancelled() for task in hall.tasks) <= gone
    assert not hall.line._waiting
    assert not hall.line._served


async def test_who_is_cancelled_while_a_thread_hashes_keeps_the_turn_until_it_is_free(hall: Hall) -> None:
    """Else whoever hangs up again and again has more threads at work than one."""
    is_hashing, may_end, order = threading.Event(), threading.Event(), list[str]()

    def work() -> None:
        is_hashing.set()
        may_end.wait(10)
        order.append("hashed")

    async def hash_it() -> None:
        async with hall.line.turn("stranger") as hashing:
            await hashing(work)

    hanging = asyncio.create_task(hash_it())
    await asyncio.to_thread(is_hashing.wait, 10)
    hanging.cancel()
    await hall.comes("stranger")
    assert hall.began == []
    may_end.set()
    with pytest.raises(asyncio.CancelledError):
        await hanging
    await asyncio.sleep(0)
    assert (order, hall.began) == (["hashed"], ["stranger"])


async def test_hashing_has_threads_of_its_own_that_stand_back_behind_the_event_loop(hall: Hall) -> None:
    def where() -> tuple[str, int]:
        thread = threading.current_thread()
        return thread.name, os.getpriority(os.PRIO_PROCESS, threading.get_native_id())

    async with hall.line.turn("somebody") as hashing:
        name, niceness = await hashing(where)
    assert name.startswith("mosaic-hashing")
    if sys.platform == "linux":
        assert niceness >= NICENESS


async def test_what_the_work_raises_is_raised_and_the_turn_is_over(hall: Hall) -> None:
    def fail() -> None:
        raise ValueError("too short")

    with pytest.raises(ValueError, match="too short"):
        async with hall.line.turn("somebody") as hashing:
            await hashing(fail)
    await hall.comes("somebody")
    assert hall.began == ["somebody"]
