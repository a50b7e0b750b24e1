"""Scene cuts: told from motion, from noise and from a strobe."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.scene_cuts import LEAST_DIFFERENCE, SceneCuts

FPS = 20


def found(differences: Iterable[float]) -> list[int]:
    cuts = SceneCuts()
    return [number for number, one in enumerate(differences) if cuts.seen(one, number / FPS)]


def test_a_new_scene_is_found_once() -> None:
    assert found([2.0] * 20 + [60.0] + [2.0] * 20) == [20]


@given(st.lists(st.floats(0.0, LEAST_DIFFERENCE), min_size=1, max_size=60))
def test_what_differs_little_is_no_cut(differences: list[float]) -> None:
    assert found(differences) == []


@given(st.floats(19.0, 80.0), st.floats(0.8, 1.2))
def test_motion_that_goes_on_is_no_cut(usual: float, jitter: float) -> None:
    assert found([usual, usual * jitter] * 30) == []


def test_a_cut_during_motion_is_found() -> None:
    assert found([20.0] * 20 + [60.0] + [20.0] * 9) == [20]
    assert found([20.0] * 20 + [49.0] + [20.0] * 9) == []


def test_motion_that_begins_is_a_cut_once() -> None:
    """The first picture of a turn is a new scene to an encoder, the second is not."""
    assert found([1.0] * 20 + [30.0] * 60) == [20]


def test_a_strobe_is_a_cut_once_a_second_at_most() -> None:
    cuts = found([1.0, 1.0, 1.0, 1.0, 80.0] * 40)
    assert len(cuts) > 1
    assert all(late - early >= FPS for early, late in pairwise(cuts))


def test_a_second_after_a_cut_there_may_be_another() -> None:
    assert found([2.0] * 20 + [60.0] + [2.0] * 19 + [60.0]) == [20, 40]
    assert found([2.0] * 20 + [60.0] + [2.0] * 18 + [60.0]) == [20]


@pytest.mark.parametrize("first", [5.0, 90.0])
def test_the_first_difference_has_nothing_to_be_compared_with(first: float) -> None:
    assert found([first, first]) == []
