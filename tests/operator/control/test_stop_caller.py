"""A stop is said on both channels at once, repeated on its own, and whoever called it has the report."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from mosaic_core.machines.control.stop_call import FIRST_REPEAT_S, StopReport
from mosaic_core.machines.timing.clock_offset import ClockSample
from mosaic_core.operator.control import stop_caller
from mosaic_core.operator.control.stop_caller import StopCaller
from mosaic_core.words.control import ControlMessage, Stop, StopAck
from mosaic_core.words.errors import ConnectionFailed

NOW_S = 500.0


class Robot:
    """The port to a robot. ``said``: on the control channel; ``said_on_stop``: on that of stops."""

    def __init__(self) -> None:
        self.said: list[ControlMessage] = []
        self.said_on_stop: list[ControlMessage] = []
        self.clock = SimpleNamespace(best=ClockSample(0, 2_000))

    def send(self, message: ControlMessage) -> bool:
        self.said.append(message)
        return True

    def send_on_stop_channel(self, message: ControlMessage) -> bool:
        self.said_on_stop.append(message)
        return True


class Timer:
    """``due_s``: when it would ring, on the clock of the loop that stands still."""

    made: list[Timer]

    def __init__(self, action: Callable[[], None]) -> None:
        self.ring = action
        self.due_s: float | None = None
        self.made.append(self)

    def set(self, due_s: float | None) -> None:
        self.due_s = due_s

    def cancel(self) -> None:
        self.due_s = None


class Stage:
    """A caller whose clock the test moves; ours and the loop's differ by an hour."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = NOW_S
        Timer.made = []
        monkeypatch.setattr(stop_caller, "DeadlineTimer", Timer)
        monkeypatch.setattr(stop_caller, "time", SimpleNamespace(monotonic=lambda: self.now_s + 3600.0))
        self.robot = Robot()
        self.caller = StopCaller(self.robot, lambda: round(self.now_s * 1e6))  # type: ignore[arg-type]
        [self.timer] = Timer.made

    async def calling(self, reason: str = "why") -> asyncio.Task[StopReport]:
        task = asyncio.create_task(self.caller.stop(reason))
        await asyncio.sleep(0)
        return task

    def answered(self, call: int = -1, safe_us: int | None = None) -> None:
        said = [one for one in self.robot.said if isinstance(one, Stop)]
        self.caller.acknowledged(StopAck(id=said[call].id, received_us=round(NOW_S * 1e6) + 4_000, safe_us=safe_us))

    def ring(self) -> None:
        assert self.timer.due_s is not None
        self.now_s = self.timer.due_s - 3600.0
        self.timer.ring()


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Stage:
    return Stage(monkeypatch)


async def test_the_first_copy_goes_out_on_both_channels_the_next_on_that_of_stops(stage: Stage) -> None:
    task = await stage.calling("a child")
    assert stage.robot.said == stage.robot.said_on_stop
    [said] = stage.robot.said
    assert isinstance(said, Stop)
    assert said.reason == "a child"
    assert stage.timer.due_s == pytest.approx(NOW_S + FIRST_REPEAT_S + 3600.0)
    stage.ring()
    stage.ring()
    assert (stage.robot.said, stage.robot.said_on_stop) == ([said], [said] * 3)
    task.cancel()


async def test_the_report_comes_with_the_word_that_it_is_safe(stage: Stage) -> None:
    task = await stage.calling()
    stage.now_s += 0.02
    stage.answered()
    await asyncio.sleep(0)
    assert not task.done(), "a safe action still runs"
    stage.answered(safe_us=round(NOW_S * 1e6) + 25_000)
    report = await task
    assert report.acknowledged_s == pytest.approx(0.02)
    assert report.received_s == pytest.approx(0.004)
    assert report.safe_s == pytest.approx(0.025)
    assert report.uncertainty_s == pytest.approx(0.001)
    assert report.is_safe
    assert stage.timer.due_s is None
    stage.answered(safe_us=1)
    assert stage.timer.due_s is None, "a second answer changes nothing"


async def test_two_stops_have_ids_and_reports_of_their_own(stage: Stage) -> None:
    one, other = await stage.calling(), await stage.calling()
    stage.answered(call=1, safe_us=0)
    await other
    assert not one.done()
    stage.answered(call=0, safe_us=0)
    assert (await one).is_safe


async def test_a_cancelled_caller_does_not_end_the_stop(stage: Stage) -> None:
    task = await stage.calling()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    stage.ring()
    assert len(stage.robot.said_on_stop) == 2
    stage.answered(safe_us=0)
    assert stage.timer.due_s is None


async def test_when_the_connection_ends_whoever_waits_is_told_and_nothing_is_said_any_more(stage: Stage) -> None:
    one, other = await stage.calling(), await stage.calling()
    stage.answered(call=0, safe_us=0)
    lost = ConnectionFailed("gone", code="channel.timeout")
    stage.caller.ended(lost)
    assert (await one).is_safe, "what was answered just before stays answered"
    with pytest.raises(ConnectionFailed) as told:
        await other
    assert told.value is lost
    assert stage.timer.due_s is None
