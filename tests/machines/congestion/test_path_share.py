"""What others leave of a link: remembered after a congestion, tried for again by who has little first."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.path_share import PathShare


def test_all_of_it_is_ours_until_a_congestion_tells_otherwise() -> None:
    share = PathShare()
    assert share.at(0.0) == 1.0
    share.congested(0.4, 5.0)
    assert share.at(5.0) == 0.4


def test_it_is_kept_then_tried_for_gently_and_is_all_ours_again_after_half_a_minute() -> None:
    share = PathShare()
    share.congested(0.5, 100.0)
    assert share.at(110.0) == 0.5
    assert share.at(115.0) - share.at(114.0) < 0.012
    assert share.at(125.0) < 0.75
    assert share.at(133.0) == 1.0


def test_the_newest_congestion_counts() -> None:
    share = PathShare()
    share.congested(0.3, 0.0)
    share.congested(0.6, 20.0)
    assert share.at(21.0) == 0.6


def test_who_has_less_tries_first_so_shares_become_equal() -> None:
    parts, shares, now_s = [0.8, 0.2], [PathShare(), PathShare()], 0.0
    for _ in range(6):
        for share, part in zip(shares, parts, strict=True):
            share.congested(0.9 * part, now_s)
        while sum(share.at(now_s) for share in shares) < 1.0:
            now_s += 0.1
        parts = [share.at(now_s) for share in shares]
    assert parts == pytest.approx([0.5, 0.5], abs=0.1)


@given(st.floats(0, 1), st.floats(0, 100), st.floats(0, 100))
def test_it_never_shrinks_by_itself_and_is_never_more_than_all(left: float, early_s: float, later_s: float) -> None:
    share = PathShare()
    share.congested(left, 7.0)
    assert left <= share.at(7.0 + early_s) <= share.at(7.0 + early_s + later_s) <= 1.0
