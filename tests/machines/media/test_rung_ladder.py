"""The ladder has no gap: every bit rate between least and most belongs to a rung."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.rung_ladder import Rung, default_ceiling_bps, ladder

SIZES = st.tuples(st.integers(16, 3840), st.integers(16, 2160))
LIMITS = st.tuples(st.integers(50_000, 2_000_000), st.none() | st.integers(100_000, 50_000_000))


@given(SIZES, LIMITS, st.sampled_from(["drive", "inspect"]), st.integers(1, 4))
def test_rungs_get_cheaper_join_each_other_and_stay_within_the_limits(
    size: tuple[int, int], limits: tuple[int, int | None], preset: str, rungs: int
) -> None:
    min_bps, max_bps = limits
    made = ladder(*size, max_bps=max_bps, min_bps=min_bps, preset=preset, rungs=rungs)  # type: ignore[arg-type]
    assert 1 <= len(made) <= rungs
    assert made[-1].floor_bps == min_bps
    assert made[0].ceiling_bps == max(min_bps, max_bps or default_ceiling_bps(*size, preset))  # type: ignore[arg-type]
    for rung in made:
        assert min_bps <= rung.floor_bps <= rung.ceiling_bps
        assert rung.width % 2 == rung.height % 2 == 0
        assert rung.frame_step >= 1
    for better, worse in itertools.pairwise(made):
        assert worse.ceiling_bps < better.ceiling_bps
        assert better.floor_bps <= worse.ceiling_bps, "a gap: such a link would fit neither"
        pixels = [rung.width * rung.height / rung.frame_step for rung in (better, worse)]
        assert pixels[1] < pixels[0]


def test_driving_keeps_motion_and_inspecting_keeps_detail() -> None:
    drive = ladder(1280, 720, preset="drive")
    inspect = ladder(1280, 720, preset="inspect")
    assert [(rung.width, rung.height, rung.frame_step) for rung in drive] == [
        (1280, 720, 1),
        (854, 480, 1),
        (640, 360, 1),
    ]
    assert [(rung.width, rung.height, rung.frame_step) for rung in inspect] == [
        (1280, 720, 1),
        (1280, 720, 2),
        (854, 480, 3),
    ]


def test_one_rung_takes_every_bit_rate() -> None:
    assert ladder(640, 480, min_bps=100_000, max_bps=900_000, rungs=1) == (Rung(640, 480, 1, 100_000, 900_000),)


def test_a_small_picture_is_not_made_smaller() -> None:
    assert {(rung.width, rung.height) for rung in ladder(200, 150, rungs=4, min_bps=50_000)} == {(200, 150)}


@pytest.mark.parametrize(
    ("size", "expected_bps"), [((640, 480), 783_360), ((160, 120), 300_000), ((3840, 2160), 8_000_000)]
)
def test_without_a_wish_the_ceiling_follows_the_size(size: tuple[int, int], expected_bps: int) -> None:
    assert default_ceiling_bps(*size) == expected_bps
