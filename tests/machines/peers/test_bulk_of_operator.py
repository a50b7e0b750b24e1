"""When an operator has a second peer connection for bulk, and when it tries again."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.bulk_of_operator import (
    LOST_AFTER_S,
    PING_PERIOD_S,
    SETUP_TIMEOUT_S,
    Begin,
    BulkAttemptFailed,
    BulkHeard,
    BulkWanted,
    DeadlinePassed,
    Effect,
    Event,
    FallBack,
    Opened,
    OperatorBulkMachine,
    SendBulkPing,
    UseLane,
)


def lane_after(*events: Event) -> OperatorBulkMachine:
    lane = OperatorBulkMachine()
    for event in events:
        lane.handle(event, 0.0, 0.0)
    return lane


def run_until(lane: OperatorBulkMachine, end_s: float) -> list[tuple[float, Effect]]:
    """Let time pass; what was done when."""
    done: list[tuple[float, Effect]] = []
    while lane.deadline_s is not None and lane.deadline_s <= end_s:
        at_s = lane.deadline_s
        done += [(at_s, effect) for effect in lane.handle(DeadlinePassed(), at_s, 0.0)]
    return done


def test_nobody_makes_one_before_it_is_wanted() -> None:
    lane = OperatorBulkMachine()
    assert (lane.state, lane.deadline_s) == ("none", None)
    assert lane.handle(BulkWanted(), 0.0, 0.0) == [Begin(1)]
    assert lane.state == "connecting"
    assert lane.handle(BulkWanted(), 0.0, 0.0) == []


def test_it_is_used_once_its_own_channel_is_open_and_pinged_from_then_on() -> None:
    lane = lane_after(BulkWanted())
    assert lane.handle(Opened(1), 1.0, 0.0) == [UseLane()]
    assert lane.handle(Opened(1), 1.0, 0.0) == []
    assert lane.state == "up"
    assert run_until(lane, 6.0) == [(1.0 + PING_PERIOD_S, SendBulkPing()), (1.0 + 2 * PING_PERIOD_S, SendBulkPing())]


def test_nobody_waits_longer_for_it_than_the_time_out() -> None:
    lane = lane_after(BulkWanted())
    assert run_until(lane, SETUP_TIMEOUT_S) == [(SETUP_TIMEOUT_S, FallBack(1, "ice.timeout", True))]
    assert (lane.state, lane.code) == ("failed", "ice.timeout")


def test_it_is_tried_again_ever_more_seldom() -> None:
    lane = lane_after(BulkWanted())
    begun_s = [at_s for at_s, effect in run_until(lane, 600.0) if isinstance(effect, Begin)]
    waits_s = [after - before - SETUP_TIMEOUT_S for before, after in zip([0.0, *begun_s], begun_s, strict=False)]
    assert waits_s[:5] == [3.0, 9.0, 27.0, 81.0, 120.0]
    assert set(waits_s[5:]) <= {120.0}


def test_one_that_was_up_for_long_comes_back_quickly() -> None:
    lane = lane_after(BulkWanted())
    run_until(lane, 100.0)
    lane.handle(DeadlinePassed(), lane.deadline_s or 0.0, 0.0)
    attempt = lane._attempt
    lane.handle(Opened(attempt), 200.0, 0.0)
    lane.handle(BulkHeard(attempt), 240.0, 0.0)
    assert lane.handle(BulkAttemptFailed(attempt, "ice.failed"), 240.0, 0.0) == [FallBack(attempt, "ice.failed", True)]
    assert lane.deadline_s == 243.0


def test_silence_ends_it_and_answers_keep_it() -> None:
    lane = lane_after(BulkWanted(), Opened(1))
    for second in range(1, 60):
        run_until(lane, float(second))
        lane.handle(BulkHeard(1), float(second), 0.0)
    assert lane.state == "up"
    last = run_until(lane, 60.0 + LOST_AFTER_S + PING_PERIOD_S)
    assert (60.0, FallBack(1, "peer.lost", True)) not in last
    assert FallBack(1, "peer.lost", True) in [effect for _, effect in last]


def test_our_own_stall_is_not_the_robots_silence() -> None:
    lane = lane_after(BulkWanted(), Opened(1))
    assert lane.handle(DeadlinePassed(), 100.0, 0.0) == [SendBulkPing()]
    assert lane.state == "up"
    assert FallBack(1, "peer.lost", True) in [effect for _, effect in run_until(lane, 110.0)]


def test_what_the_robot_said_itself_is_not_told_to_it() -> None:
    lane = lane_after(BulkWanted())
    assert lane.handle(BulkAttemptFailed(1, "lane.refused", is_told=True), 1.0, 0.0) == [
        FallBack(1, "lane.refused", False)
    ]


def test_what_comes_of_an_abandoned_attempt_changes_nothing() -> None:
    lane = lane_after(BulkWanted(), BulkAttemptFailed(1, "ice.failed"))
    assert lane.handle(Opened(1), 1.0, 0.0) == []
    assert run_until(lane, 3.0) == [(3.0, Begin(2))]
    assert lane.handle(Opened(1), 3.0, 0.0) == []
    assert lane.handle(BulkAttemptFailed(1, "ice.failed"), 3.0, 0.0) == []
    assert lane.state == "connecting"


def test_a_deadline_that_has_not_come_is_ignored() -> None:
    lane = lane_after(BulkWanted())
    assert lane.handle(DeadlinePassed(), SETUP_TIMEOUT_S - 0.1, 0.0) == []


attempts = st.integers(0, 4)
events = st.one_of(
    st.just(BulkWanted()),
    st.just(DeadlinePassed()),
    st.builds(Opened, attempts),
    st.builds(BulkHeard, attempts),
    st.builds(BulkAttemptFailed, attempts, st.sampled_from(["ice.failed", "peer.lost"]), st.booleans()),
)


@given(st.lists(st.tuples(events, st.floats(0, 10)), max_size=60), st.floats(0, 0.99))
def test_every_attempt_that_begins_is_used_or_given_up_before_the_next(
    steps: list[tuple[Event, float]], random_unit: float
) -> None:
    lane, now_s, open_attempts = OperatorBulkMachine(), 0.0, 0
    for event, wait_s in steps:
        now_s += wait_s
        for effect in lane.handle(event, now_s, random_unit):
            open_attempts += {Begin: 1, FallBack: -1}.get(type(effect), 0)
            assert open_attempts in (0, 1)
    assert (open_attempts == 1) == (lane.state in ("connecting", "up"))
    assert (lane.deadline_s is None) == (lane.state == "none")
