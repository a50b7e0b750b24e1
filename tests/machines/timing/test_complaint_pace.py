"""A complaint comes at once, then at most once per period, whoever else complains."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.complaint_pace import COMPLAINT_PERIOD_S, ComplaintPace


def test_the_first_complaint_is_said_and_again_once_the_period_is_over() -> None:
    pace = ComplaintPace()
    assert [pace.is_due("scan", at_s) for at_s in (5.0, 5.0, 5.0 + COMPLAINT_PERIOD_S - 0.1)] == [True, False, False]
    assert pace.is_due("pose", 6.0)
    assert pace.is_due("scan", 5.0 + COMPLAINT_PERIOD_S)


@given(st.lists(st.floats(0, 100), max_size=60).map(sorted), st.floats(0.1, 50))
def test_between_two_of_one_kind_lies_a_period_and_silence_is_never_longer_than_needed(
    at_s: list[float], period_s: float
) -> None:
    pace = ComplaintPace(period_s)
    said = [now_s for now_s in at_s if pace.is_due("scan", now_s)]
    assert said[:1] == at_s[:1]
    assert all(later - earlier >= period_s for earlier, later in pairwise(said))
    for now_s in at_s:
        assert any(now_s - period_s < one <= now_s for one in said)
