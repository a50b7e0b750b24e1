"""Wishes for key frames: merged, kept rare, never forgotten."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.key_frame_requests import BURST, MIN_INTERVAL_S, REFILL_S, KeyFrameRequests

PICTURE_S = 1 / 30


def test_without_a_wish_there_is_none() -> None:
    requests = KeyFrameRequests()
    assert not any(requests.take(number * PICTURE_S) for number in range(300))


def test_wishes_of_many_viewers_are_one_key_frame() -> None:
    requests = KeyFrameRequests()
    for _ in range(10):
        requests.ask()
    assert [requests.take(number * PICTURE_S) for number in range(100)].count(True) == 1


def test_one_that_was_made_anyway_serves_all_who_asked() -> None:
    requests = KeyFrameRequests()
    requests.ask()
    requests.made(1.0)
    assert not requests.is_pending
    assert not requests.take(5.0)


@given(st.lists(st.floats(0, 30), max_size=60), st.sampled_from([1 / 60, 1 / 30, 1 / 10]))
def test_they_stay_rare_and_every_wish_is_granted_soon(wishes_s: list[float], picture_s: float) -> None:
    requests, made_s = KeyFrameRequests(), []
    waiting = sorted(wishes_s)
    pending_since_s: float | None = None
    for number in range(int(40 / picture_s)):
        now_s = number * picture_s
        while waiting and waiting[0] <= now_s:
            pending_since_s = pending_since_s if pending_since_s is not None else waiting[0]
            waiting.pop(0)
            requests.ask()
        if requests.take(now_s):
            made_s.append(now_s)
            pending_since_s = None
        assert pending_since_s is None or now_s - pending_since_s <= REFILL_S + 2 * picture_s
    for earlier_s, later_s in itertools.pairwise(made_s):
        assert later_s - earlier_s >= MIN_INTERVAL_S - 1e-3
    for start_s in made_s:
        within = [time_s for time_s in made_s if start_s <= time_s < start_s + 5]
        assert len(within) <= BURST + 5 / REFILL_S
