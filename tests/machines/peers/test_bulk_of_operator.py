"""When an operator has a second peer connection for bulk, and when it tries again."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.bulk_of_operator import (
    LOST_AFTER_S,
    PING_PERIOD_S,
    SETUP_TIMEOUT_S,
    Begin,
    BulkCloseHeard,
    BulkFailed,
    BulkHeard,
    BulkWanted,
    DeadlinePassed,
    DropBulk,
    Effect,
    Event,
    Opened,
    OperatorBulkMachine,
    SendBulkPing,
    TellBulkClosed,
    UseBulk,
)


def bulk_after(*events: Event) -> OperatorBulkMachine:
    bulk = OperatorBulkMachine(lambda: 0.0)
    for event in events:
        bulk.handle(event, 0.0)
    return bulk


def run_until(bulk: OperatorBulkMachine, end_s: float) -> list[tuple[float, Effect]]:
    """Let time pass; what was done when."""
    done: list[tuple[float, Effect]] = []
    while bulk.deadline_s is not None and bulk.deadline_s <= end_s:
        at_s = bulk.deadline_s
        done += [(at_s, effect) for effect in bulk.handle(DeadlinePassed(), at_s)]
    return done


def test_nobody_makes_one_before_it_is_wanted() -> None:
    bulk = OperatorBulkMachine(lambda: 0.0)
    assert (bulk.state, bulk.deadline_s) == ("none", None)
    assert bulk.handle(BulkWanted(), 0.0) == [Begin(1)]
    assert bulk.state == "connecting"
    assert bulk.handle(BulkWanted(), 0.0) == []


def test_it_is_used_once_its_own_channel_is_open_and_pinged_from_then_on() -> None:
    bulk = bulk_after(BulkWanted())
    assert bulk.handle(Opened(1), 1.0) == [UseBulk()]
    assert bulk.handle(Opened(1), 1.0) == []
    assert bulk.state == "up"
    assert run_until(bulk, 6.0) == [(1.0 + PING_PERIOD_S, SendBulkPing()), (1.0 + 2 * PING_PERIOD_S, SendBulkPing())]


def test_nobody_waits_longer_for_it_than_the_time_out() -> None:
    bulk = bulk_after(BulkWanted())
    assert run_until(bulk, SETUP_TIMEOUT_S) == [
        (SETUP_TIMEOUT_S, TellBulkClosed(1, "ice.timeout")),
        (SETUP_TIMEOUT_S, DropBulk()),
    ]
    assert (bulk.state, bulk.code) == ("failed", "ice.timeout")


def test_it_is_tried_again_ever_more_seldom() -> None:
    bulk = bulk_after(BulkWanted())
    begun_s = [at_s for at_s, effect in run_until(bulk, 600.0) if isinstance(effect, Begin)]
    waits_s = [after - before - SETUP_TIMEOUT_S for before, after in zip([0.0, *begun_s], begun_s, strict=False)]
    assert waits_s[:5] == [3.0, 9.0, 27.0, 81.0, 120.0]
    assert set(waits_s[5:]) <= {120.0}


def test_one_that_was_up_for_long_comes_back_quickly() -> None:
    bulk = bulk_after(BulkWanted())
    run_until(bulk, 100.0)
    bulk.handle(DeadlinePassed(), bulk.deadline_s or 0.0)
    attempt = bulk._attempt
    bulk.handle(Opened(attempt), 200.0)
    bulk.handle(BulkHeard(attempt), 240.0)
    assert bulk.handle(BulkFailed(attempt, "ice.failed"), 240.0) == [
        TellBulkClosed(attempt, "ice.failed"),
        DropBulk(),
    ]
    assert bulk.deadline_s == 243.0


def test_silence_ends_it_and_answers_keep_it() -> None:
    bulk = bulk_after(BulkWanted(), Opened(1))
    for second in range(1, 60):
        run_until(bulk, float(second))
        bulk.handle(BulkHeard(1), float(second))
    assert bulk.state == "up"
    last = run_until(bulk, 60.0 + LOST_AFTER_S + PING_PERIOD_S)
    assert (60.0, TellBulkClosed(1, "peer.lost")) not in last
    assert TellBulkClosed(1, "peer.lost") in [effect for _, effect in last]


def test_our_own_stall_is_not_the_robots_silence() -> None:
    bulk = bulk_after(BulkWanted(), Opened(1))
    assert bulk.handle(DeadlinePassed(), 100.0) == [SendBulkPing()]
    assert bulk.state == "up"
    assert TellBulkClosed(1, "peer.lost") in [effect for _, effect in run_until(bulk, 110.0)]


def test_a_failure_without_a_code_is_named_by_how_far_it_came() -> None:
    assert bulk_after(BulkWanted()).handle(BulkFailed(1), 1.0) == [TellBulkClosed(1, "ice.failed"), DropBulk()]
    bulk = bulk_after(BulkWanted(), Opened(1))
    assert bulk.handle(BulkFailed(1), 1.0) == [TellBulkClosed(1, "peer.lost"), DropBulk()]
    assert bulk.code == "peer.lost"


def test_what_the_robot_said_itself_is_not_told_to_it() -> None:
    bulk = bulk_after(BulkWanted())
    assert bulk.handle(BulkCloseHeard(1, "lane.refused"), 1.0) == [DropBulk()]


def test_what_comes_of_an_abandoned_attempt_changes_nothing() -> None:
    bulk = bulk_after(BulkWanted(), BulkFailed(1, "ice.failed"))
    assert bulk.handle(Opened(1), 1.0) == []
    assert run_until(bulk, 3.0) == [(3.0, Begin(2))]
    assert bulk.handle(Opened(1), 3.0) == []
    assert bulk.handle(BulkFailed(1, "ice.failed"), 3.0) == []
    assert bulk.state == "connecting"


def test_a_deadline_that_has_not_come_is_ignored() -> None:
    bulk = bulk_after(BulkWanted())
    assert bulk.handle(DeadlinePassed(), SETUP_TIMEOUT_S - 0.1) == []


attempts = st.integers(0, 4)
events = st.one_of(
    st.just(BulkWanted()),
    st.just(DeadlinePassed()),
    st.builds(Opened, attempts),
    st.builds(BulkHeard, attempts),
    st.builds(BulkFailed, attempts, st.sampled_from(["ice.failed", "peer.lost"])),
    st.builds(BulkCloseHeard, attempts, st.just("lane.refused")),
)


@given(st.lists(st.tuples(events, st.floats(0, 10)), max_size=60), st.floats(0, 0.99))
def test_every_attempt_that_begins_is_used_or_given_up_before_the_next(
    steps: list[tuple[Event, float]], drawn: float
) -> None:
    bulk, now_s, open_attempts = OperatorBulkMachine(lambda: drawn), 0.0, 0
    for event, wait_s in steps:
        now_s += wait_s
        for effect in bulk.handle(event, now_s):
            open_attempts += {Begin: 1, DropBulk: -1}.get(type(effect), 0)
            assert open_attempts in (0, 1)
    assert (open_attempts == 1) == (bulk.state in ("connecting", "up"))
    assert (bulk.deadline_s is None) == (bulk.state == "none")
