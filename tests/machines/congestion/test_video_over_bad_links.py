"""What one operator's video is like over bad links: how long pictures stand, how old they get, how soon all is well
again. Played without a network, see ``link_film.py``."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from link_film import Film, profile

from mosaic_core.machines.laboratory.impaired_link import LinkProfile

SETTLE_S = 6.0


def settled(link_profile: LinkProfile, seed: int) -> Film:
    return Film(link_profile, seed).play(SETTLE_S)


@pytest.mark.parametrize("seed", range(3))
def test_on_a_good_link_it_is_soon_at_its_best_and_sends_nothing_twice(seed: int) -> None:
    film = settled(profile(20), seed)
    sent_before = film.sent_bytes
    film.play(10)
    assert film.picture_bps == film.rungs[0].ceiling_bps
    assert (film.sent_bytes - sent_before) * 8 / 10 < 1.05 * film.picture_bps
    assert film.freezes(1.0) == 0
    assert film.ages_ms(SETTLE_S)[-1] < 80


@pytest.mark.parametrize(("loss", "freezes", "p95_ms"), [(0.01, 0, 60), (0.03, 1, 60), (0.08, 1, 110)])
@pytest.mark.parametrize("seed", range(3))
def test_lost_packets_are_hardly_seen_and_cost_no_bits_of_the_picture(
    loss: float, freezes: int, p95_ms: float, seed: int
) -> None:
    film = settled(profile(), seed)
    film.become(profile(loss=loss))
    film.play(60)
    assert film.freezes(SETTLE_S) <= freezes
    assert film.p95_ms(SETTLE_S) < p95_ms
    assert film.picture_bps == film.rungs[0].ceiling_bps


@pytest.mark.parametrize("seed", range(3))
def test_a_path_that_narrows_is_followed_within_a_second_or_so(seed: int) -> None:
    film = settled(profile(4), seed)
    film.become(profile(1))
    film.play(30)
    assert film.freezes(SETTLE_S) <= 1
    assert film.ages_ms(SETTLE_S)[-1] < 450
    assert film.well_again_s(SETTLE_S, 150) < 2.0
    assert film.p95_ms(SETTLE_S + 5) < 150
    assert 500_000 < film.part_bps < 1_000_000


@pytest.mark.parametrize("seed", range(3))
def test_a_path_that_widens_is_used_within_seconds(seed: int) -> None:
    film = settled(profile(1), seed).play(10)
    film.become(profile(4))
    since_s = film.now_s
    film.play(15)
    assert next(at_s for at_s, bps in film.rates if at_s > since_s and bps > 1_500_000) - since_s < 5
    assert film.freezes(since_s) == 0
    assert film.p95_ms(since_s) < 100


def test_a_narrow_path_that_loses_packets_is_not_overrun_by_copies() -> None:
    film = settled(profile(1, loss=0.03), 1).play(60)
    assert film.freezes(SETTLE_S) <= 6
    assert film.p95_ms(SETTLE_S) < 250
    assert film.part_bps > 400_000


@settings(max_examples=15, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.sampled_from([0.5, 1, 2, 4, 10, None]), st.sampled_from([0.0, 0.01, 0.05])), max_size=4
    ),
    seed=st.integers(0, 9),
)
def test_whatever_the_path_does_pictures_come_and_are_never_old_for_long(
    steps: list[tuple[float | None, float]], seed: int
) -> None:
    film = settled(profile(4), seed)
    for rate_mbps, loss in steps:
        film.become(profile(rate_mbps, loss))
        film.play(8)
    film.become(profile(4))
    film.play(8)
    since_s = film.now_s - 3
    assert len(film.ages_ms(since_s)) > 60
    assert film.p95_ms(since_s) < 200
