"""A stop is said until it is answered, and its report counts from the moment it was said."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.control.stop_call import (
    SAFE_PATIENCE_S,
    SayStop,
    StopCallEnded,
    StopCalls,
    StopReport,
)
from mosaic_core.machines.timing.clock_offset import ClockSample
from mosaic_core.words.control import STOP_REPEAT_S, Stop, StopAck

HOUR_US = 3_600_000_000


def ack(received_us: int = 0, safe_us: int | None = None, id_: str = "a") -> StopAck:
    return StopAck(id=id_, received_us=received_us, safe_us=safe_us)


def test_it_is_said_at_once_soon_again_and_then_every_thirty_milliseconds() -> None:
    calls = StopCalls()
    assert calls.say("a", "why", 1.0) == [SayStop(Stop(id="a", reason="why"), is_first=True)]
    assert calls.overdue(1.009) == []
    assert calls.overdue(1.01) == [SayStop(Stop(id="a", reason="why"))]
    assert calls.deadline_s == 1.01 + STOP_REPEAT_S


def test_only_the_first_copy_goes_on_the_control_channel_too() -> None:
    calls = StopCalls()
    copies = calls.say("a", "", 0.0) + calls.overdue(0.01) + calls.overdue(0.04)
    assert [copy.is_first for copy in copies if isinstance(copy, SayStop)] == [True, False, False]


def test_of_two_stops_each_is_repeated_in_its_own_time() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    calls.overdue(0.01)
    calls.say("b", "", 0.02)
    assert calls.deadline_s == 0.03
    assert calls.overdue(0.03) == [SayStop(Stop(id="b", reason=""))]
    assert calls.deadline_s == 0.01 + STOP_REPEAT_S


def test_a_stop_that_is_given_up_keeps_no_other_from_being_repeated() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    calls.acknowledged(ack(5), None, 0.1)
    calls.say("b", "", 2.0)
    given_up, repeated = calls.overdue(0.1 + SAFE_PATIENCE_S)
    assert isinstance(given_up, StopCallEnded)
    assert given_up.id == "a"
    assert repeated == SayStop(Stop(id="b", reason=""))


@pytest.mark.parametrize("offset_us", [0, HOUR_US, -HOUR_US])
def test_the_report_counts_on_the_robots_clock_whatever_ours_says(offset_us: int) -> None:
    calls = StopCalls()
    said_us = 7_200_000_000
    calls.say("a", "", said_us / 1e6)
    calls.overdue(said_us / 1e6 + 0.03)
    robot_us = said_us + offset_us
    clock = ClockSample(offset_us, 8_000)
    (stopped,) = calls.acknowledged(ack(robot_us + 4_000, robot_us + 25_000), clock, said_us / 1e6 + 0.05)
    assert isinstance(stopped, StopCallEnded)
    report = stopped.report
    assert report.acknowledged_s == pytest.approx(0.05)
    assert report.received_s == pytest.approx(0.004)
    assert report.safe_s == pytest.approx(0.025)
    assert report.uncertainty_s == pytest.approx(0.004)
    assert (report.copies, report.is_safe) == (2, True)
    assert calls.deadline_s is None


def test_an_answer_that_seems_older_than_the_stop_came_at_once() -> None:
    """The robot's clock is only known to within half a round trip."""
    calls = StopCalls()
    calls.say("a", "", 10.0)
    (stopped,) = calls.acknowledged(ack(9_999_000, 9_999_500), ClockSample(0, 3_000_000), 13.0)
    assert isinstance(stopped, StopCallEnded)
    assert (stopped.report.received_s, stopped.report.safe_s, stopped.report.uncertainty_s) == (0.0, 0.0, 1.5)


def test_without_a_known_clock_only_the_round_trip_is_told() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    (stopped,) = calls.acknowledged(ack(5, 6), None, 0.2)
    assert stopped == StopCallEnded("a", StopReport(0.2, None, None, None, 1, True))


def test_an_acknowledgement_whose_safe_action_runs_is_asked_again_for_two_seconds() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    assert calls.acknowledged(ack(5), None, 0.1) == []
    now_s, copies = 0.1, 0
    while True:
        now_s = calls.deadline_s or 0.0
        (effect,) = calls.overdue(now_s)
        if isinstance(effect, StopCallEnded):
            break
        copies += 1
    assert 2.1 <= now_s < 2.2
    assert effect.report.acknowledged_s == 0.1
    assert not effect.report.is_safe
    assert copies > 50


def test_a_second_answer_tells_that_it_is_safe_and_keeps_the_first_ones_time() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    calls.acknowledged(ack(10_000), ClockSample(0, 0), 0.02)
    (stopped,) = calls.acknowledged(ack(10_000, 300_000), ClockSample(0, 0), 0.4)
    assert isinstance(stopped, StopCallEnded)
    assert (stopped.report.acknowledged_s, stopped.report.received_s, stopped.report.safe_s) == (0.02, 0.01, 0.3)
    assert calls.acknowledged(ack(10_000, 300_000), None, 0.5) == []


def test_forgetting_ends_the_repeating() -> None:
    calls = StopCalls()
    calls.say("a", "", 0.0)
    calls.forget()
    assert calls.deadline_s is None
    assert calls.acknowledged(ack(1, 2), None, 1.0) == []


@given(st.lists(st.tuples(st.sampled_from("sbar"), st.sampled_from("xyz"), st.floats(0, 0.5))))
def test_every_stop_is_repeated_until_its_own_answer_and_never_after(steps: list[tuple[str, str, float]]) -> None:
    calls, open_ids, now_s = StopCalls(), set[str](), 0.0
    for step, id_, wait_s in steps:
        now_s += wait_s
        if step == "s":
            calls.say(id_, "", now_s)
            open_ids.add(id_)
        elif step == "b":
            calls.acknowledged(ack(1, 2, id_), None, now_s)
            open_ids.discard(id_)
        elif step == "a":
            calls.acknowledged(ack(1, None, id_), None, now_s)
        else:
            for effect in calls.overdue(now_s):
                if isinstance(effect, StopCallEnded):
                    open_ids.discard(effect.id)
                else:
                    assert effect.message.id in open_ids
        assert (calls.deadline_s is None) == (not open_ids)
