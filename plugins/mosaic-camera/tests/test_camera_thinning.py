"""Fewer pictures at the wanted rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_camera.thinning import PictureThinning


def taken(fps: float | None, times: list[float]) -> list[float]:
    thinning = PictureThinning(fps)
    return [at_s for at_s in times if thinning.takes(at_s)]


def test_without_a_wish_every_picture_is_shown() -> None:
    assert taken(None, [0.0, 0.001, 0.002]) == [0.0, 0.001, 0.002]


@given(wanted=st.floats(1, 60), given_fps=st.floats(60, 120))
def test_the_mean_rate_is_the_wanted_one(wanted: float, given_fps: float) -> None:
    shown = taken(wanted, [n / given_fps for n in range(round(10 * given_fps))])
    assert len(shown) == pytest.approx(10 * wanted, abs=2)


def test_a_source_of_the_wanted_rate_that_jitters_loses_nothing() -> None:
    jitter = np.random.default_rng(0).uniform(-0.006, 0.006, 300)
    times = [float(n / 30 + early) for n, early in enumerate(jitter)]
    assert len(taken(30, times)) >= 298


def test_after_a_gap_there_is_no_burst() -> None:
    shown = taken(10, [0.0, 5.0, 5.01, 5.02, 5.1])
    assert shown == [0.0, 5.0, 5.1]
