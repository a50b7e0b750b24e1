from __future__ import annotations

from itertools import pairwise
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.playout import (
    DELAY,
    IDLE_STEPS,
    MAX_GAP,
    MAX_WAITING,
    RATE_HZ,
    STEP,
    Play,
    Playout,
    PlaySilence,
    TalkOver,
)


def filled(*numbers: int) -> Playout[int]:
    playout: Playout[int] = Playout()
    for number in numbers:
        playout.put(number * STEP, STEP, number)
    return playout


def taken(playout: Playout[int], steps: int) -> list[Any]:
    """Numbers of what was played, ``-`` for silence, ``.`` for nothing, ``!`` for the end."""
    marks = {PlaySilence: "-", TalkOver: "!", type(None): "."}
    return [step.item if isinstance(step := playout.take(), Play) else marks[type(step)] for _ in range(steps)]


def test_nothing_is_played_before_the_delay_is_filled() -> None:
    playout = filled(0)
    assert taken(playout, 1) == ["."]
    playout.put(STEP, STEP, 1)
    assert taken(playout, 2) == [0, 1]


def test_a_word_shorter_than_the_delay_is_played_all_the_same() -> None:
    assert taken(filled(0), 4) == [".", ".", 0, "-"]


def test_what_comes_in_the_wrong_order_is_played_in_the_right_one() -> None:
    assert taken(filled(1, 0, 3, 2), 4) == [0, 1, 2, 3]


def test_a_lost_piece_is_silence() -> None:
    assert taken(filled(0, 1, 3), 4) == [0, 1, "-", 3]


def test_a_piece_after_its_turn_is_dropped() -> None:
    playout = filled(0, 1, 3)
    taken(playout, 3)
    assert not playout.put(2 * STEP, STEP, 2)
    assert playout.late == 1
    assert taken(playout, 1) == [3]


def test_a_late_talker_keeps_its_turn_and_the_delay_grows_instead() -> None:
    playout = filled(0, 1)
    assert taken(playout, 3) == [0, 1, "-"]
    assert playout.put(2 * STEP, STEP, 2)
    assert taken(playout, 1) == [2]
    assert playout.late == 0


def test_a_pause_of_the_talker_is_not_waited_through() -> None:
    pause = MAX_GAP // STEP + 3
    assert taken(filled(0, 1, pause), 3) == [0, 1, pause]


def test_half_a_second_of_nothing_ends_the_talk() -> None:
    playout = filled(0, 1)
    taken(playout, 2)
    assert taken(playout, IDLE_STEPS + 1) == ["-"] * (IDLE_STEPS - 1) + ["!", "."]
    assert playout.is_idle


def test_what_piles_up_is_skipped_down_to_the_delay() -> None:
    playout = filled(*range(30))
    assert playout.waiting <= MAX_WAITING
    assert playout.skipped > 0
    numbers = [step for step in taken(playout, 12) if step != "-"]
    assert numbers[-1] == 29


def test_a_piece_twice_is_played_once() -> None:
    playout = filled(0, 1)
    assert not playout.put(STEP, STEP, 1)
    assert taken(playout, 3) == [0, 1, "-"]


def test_cleared_it_is_silent_at_once() -> None:
    playout = filled(0, 1, 2)
    taken(playout, 1)
    playout.clear()
    assert playout.is_idle
    assert taken(playout, 2) == [".", "."]


def test_a_talker_whose_clock_begins_anew_is_heard() -> None:
    playout = filled(1000, 1001)
    taken(playout, 2)
    assert 1001 * STEP > RATE_HZ
    assert playout.put(0, STEP, 0)
    assert playout.put(STEP, STEP, 1)
    assert taken(playout, 2) == [0, 1]


@given(st.lists(st.one_of(st.integers(0, 40), st.none())))
def test_whatever_arrives_is_played_in_order_once_and_latency_stays_bounded(events: list[int | None]) -> None:
    playout: Playout[int] = Playout()
    accepted, played = 0, []
    for event in events:
        if event is None:
            step = playout.take()
            played += [step.item] if isinstance(step, Play) else []
        else:
            accepted += playout.put(event * STEP, STEP, event)
        assert playout.waiting <= MAX_WAITING
    # a piece that was skipped in the moment of its arrival counts in `skipped` only
    assert len(played) + playout.waiting // STEP <= accepted
    restarts = sum(later <= earlier for earlier, later in pairwise(played))
    assert restarts == 0 or playout.is_idle or len(events) > IDLE_STEPS
    assert playout.waiting // STEP + len(played) + playout.skipped >= accepted


@given(st.lists(st.integers(0, 6), min_size=20, max_size=200))
def test_jitter_below_the_delay_is_never_heard(jitters: list[int]) -> None:
    """Pieces leave every 20 ms and arrive up to 30 ms late: once playing, no silence comes between them."""
    arrivals = sorted((number * 4 + jitter, number) for number, jitter in enumerate(jitters))  # in quarters of a step
    playout: Playout[int] = Playout()
    heard: list[Any] = []
    for quarter in range(4 * len(jitters)):
        for _, number in [one for one in arrivals if one[0] == quarter]:
            playout.put(number * STEP, STEP, number)
        if quarter % 4 == 3:
            heard += [mark for mark in taken(playout, 1) if mark != "."]
    gaps = heard.count("-")
    assert gaps * STEP <= DELAY
    numbers = [mark for mark in heard if mark != "-"]
    assert numbers == sorted(numbers)


def test_a_gap_of_a_single_sample_is_silence_too() -> None:
    playout = filled(0, 1)
    assert taken(playout, 2) == [0, 1]
    playout.put(2 * STEP + 1, STEP, 2)
    assert playout.take() == PlaySilence(1)
    assert taken(playout, 1) == [2]
