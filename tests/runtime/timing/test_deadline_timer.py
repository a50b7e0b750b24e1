"""A timer calls back once, and never before its deadline."""

from __future__ import annotations

import asyncio
import time

import pytest

from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer


class Early:
    """A loop whose timers come before their time, as uvloop's do by up to a millisecond."""

    def __init__(self, early_s: float) -> None:
        self._loop, self._early_s = asyncio.get_running_loop(), early_s

    def call_later(self, delay_s: float, passed: object) -> asyncio.TimerHandle:
        return self._loop.call_later(max(0.0, delay_s - self._early_s), passed)  # type: ignore[arg-type]


async def test_where_timers_come_early_it_still_calls_back_after_its_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Early(0.005)
    monkeypatch.setattr(asyncio, "get_running_loop", lambda: loop)
    passed = asyncio.Queue[float]()
    timer = DeadlineTimer(lambda: passed.put_nowait(time.monotonic()))
    for delay_s in (0.02, 0.003, 0.0):
        deadline_s = time.monotonic() + delay_s
        timer.set(deadline_s)
        assert await passed.get() >= deadline_s
        assert not timer.is_set
    assert passed.empty()


async def test_a_deadline_that_moves_is_the_only_one_and_one_that_is_taken_back_is_none() -> None:
    passed: list[float] = []
    timer = DeadlineTimer(lambda: passed.append(time.monotonic()))
    now_s = time.monotonic()
    timer.set(now_s)
    timer.set(now_s + 0.02)
    other = asyncio.Event()
    second = DeadlineTimer(other.set)
    second.set(now_s + 0.04)
    await other.wait()
    assert len(passed) == 1
    assert passed[0] >= now_s + 0.02
    timer.set(time.monotonic())
    timer.set(None)
    timer.set(time.monotonic())
    timer.cancel()
    other.clear()
    second.set(time.monotonic() + 0.02)
    await other.wait()
    assert len(passed) == 1
