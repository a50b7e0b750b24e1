"""What others leave of a link: remembered after a congestion, tried for again by who has little first."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.path_share import PathShare

LINK_BPS = 1e6
FAST_BPS = 50 * LINK_BPS


def at(share: PathShare, now_s: float) -> float:
    """Of the link, where trains tell its speed."""
    return share.bps(LINK_BPS, now_s) / LINK_BPS


def congest(share: PathShare, left: float, now_s: float, trains_bps: float = LINK_BPS) -> PathShare:
    share.trains_came(trains_bps, now_s)
    share.congested(left * LINK_BPS, left, now_s)
    return share


def test_all_of_it_is_ours_until_a_congestion_tells_otherwise() -> None:
    share = PathShare()
    assert at(share, 0.0) == 1.0
    congest(share, 0.4, 5.0)
    assert at(share, 5.0) == 0.4


def test_it_is_kept_then_tried_for_gently_and_is_all_ours_again_after_half_a_minute() -> None:
    share = PathShare()
    congest(share, 0.5, 100.0)
    assert at(share, 110.0) == 0.5
    assert at(share, 115.0) - at(share, 114.0) < 0.012
    assert at(share, 125.0) < 0.75
    assert at(share, 133.0) == 1.0


def test_the_newest_congestion_counts() -> None:
    share = PathShare()
    congest(share, 0.3, 0.0)
    congest(share, 0.6, 20.0)
    assert at(share, 21.0) == 0.6


def test_who_has_less_tries_first_so_shares_become_equal() -> None:
    parts, shares, now_s = [0.8, 0.2], [PathShare(), PathShare()], 0.0
    for _ in range(6):
        for share, part in zip(shares, parts, strict=True):
            congest(share, 0.9 * part, now_s)
        while sum(at(share, now_s) for share in shares) < 1.0:
            now_s += 0.1
        parts = [at(share, now_s) for share in shares]
    assert parts == pytest.approx([0.5, 0.5], abs=0.1)


@given(st.floats(0, 1), st.floats(0, 100), st.floats(0, 100))
def test_it_never_shrinks_by_itself_and_is_never_more_than_all(left: float, early_s: float, later_s: float) -> None:
    share = PathShare()
    congest(share, left, 7.0)
    assert left - 1e-9 <= at(share, 7.0 + early_s) <= at(share, 7.0 + early_s + later_s) <= 1.0


def shaped() -> PathShare:
    """Twice at the same speed there was a queue, though trains had been much faster."""
    return congest(congest(PathShare(), 1.0, 0.0), 1.0, 10.0, FAST_BPS)


def test_a_shaper_that_lets_short_trains_through_at_once_is_known_at_the_second_congestion() -> None:
    share = congest(PathShare(), 1.0, 0.0, FAST_BPS)
    assert share.bps(FAST_BPS, 1.0) == FAST_BPS
    assert shaped().bps(FAST_BPS, 11.0) == LINK_BPS


def test_more_than_a_shaper_took_is_tried_gently_and_then_boldly() -> None:
    share = shaped()
    assert share.bps(FAST_BPS, 30.0) == LINK_BPS
    assert share.bps(FAST_BPS, 36.0) - share.bps(FAST_BPS, 35.0) < 0.015 * LINK_BPS
    assert share.bps(FAST_BPS, 65.0) > 2 * LINK_BPS


def test_trains_of_before_the_last_congestion_say_nothing_of_a_shaper() -> None:
    share = congest(congest(PathShare(), 1.0, 50.0), 1.0, 50.9, FAST_BPS)
    assert share.bps(FAST_BPS, 52.0) == FAST_BPS


def test_trains_that_were_hardly_faster_than_the_link_tell_of_no_shaper() -> None:
    share = congest(congest(PathShare(), 1.0, 0.0), 1.0, 10.0, 1.4 * LINK_BPS)
    assert share.bps(FAST_BPS, 11.0) == FAST_BPS


@pytest.mark.parametrize("unit", [2.0**-30, 2.0**30])
def test_the_unit_of_speed_makes_no_difference(unit: float) -> None:
    """Trains come, there is a congestion, nothing comes, and another: no shaper was seen."""
    share = PathShare()
    share.trains_came(50.0 * unit, 0.0)
    share.congested(unit, 1.0, 10.0)
    share.congested(unit, 1.0, 20.0)
    assert share.bps(50.0 * unit, 21.0) == 50.0 * unit


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_link_of_another_speed_is_another_link(factor: float) -> None:
    share = shaped()
    share.congested(factor * LINK_BPS, 1.0, 20.0)
    assert share.bps(FAST_BPS, 21.0) == FAST_BPS


def test_how_much_is_left_stays_known_where_a_congestion_does_not_tell() -> None:
    share = congest(PathShare(), 0.5, 0.0)
    share.congested(0.5 * LINK_BPS, None, 5.0)
    assert at(share, 6.0) == 0.5


def test_a_first_congestion_that_does_not_tell_leaves_all_of_the_link_to_us() -> None:
    share = PathShare()
    share.congested(LINK_BPS, None, 0.0)
    assert at(share, 1.0) == 1.0
    assert congest(share, 1.0, 10.0, FAST_BPS).bps(FAST_BPS, 11.0) == LINK_BPS, "the same link: its shaper is known"
