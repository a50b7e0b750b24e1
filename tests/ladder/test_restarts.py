"""A connector that stops slowly is restarted less often, so that whoever broke it need not wait."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.ladder.lives import FEWEST_RESTARTS, RESTARTS_S, restarts_of


def test_what_stops_at_once_is_restarted_as_often_as_wanted() -> None:
    assert restarts_of(100, 0.0) == 100
    assert restarts_of(3, 5.0) == 3


@given(wanted=st.integers(FEWEST_RESTARTS, 1000), stop_s=st.floats(0.0, 5.0))
def test_there_are_enough_restarts_and_they_end_in_time(wanted: int, stop_s: float) -> None:
    restarts = restarts_of(wanted, stop_s)
    assert FEWEST_RESTARTS <= restarts <= wanted
    assert restarts == FEWEST_RESTARTS or restarts * stop_s <= RESTARTS_S
