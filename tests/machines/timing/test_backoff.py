"""Back-off waits longer each time, within its bounds."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy

POLICY = BackoffPolicy(first_s=1.0, factor=2.0, max_s=10.0, jitter=0.5, stable_s=5.0)


def test_every_failure_doubles_the_wait_up_to_the_maximum() -> None:
    backoff = Backoff(POLICY)
    assert [backoff.failed(0.0, 0.0) for _ in range(6)] == [1, 2, 4, 8, 10, 10]


def test_jitter_only_shortens() -> None:
    assert Backoff(POLICY).failed(0.0, 0.999) == pytest.approx(0.5, abs=0.01)


def test_a_long_success_starts_over() -> None:
    backoff = Backoff(POLICY)
    backoff.failed(0.0, 0.0)
    backoff.failed(4.9, 0.0)
    assert backoff.failed(5.0, 0.0) == 1.0


def test_reset_forgets_all_failures() -> None:
    backoff = Backoff(POLICY)
    backoff.failed(0.0, 0.0)
    backoff.reset()
    assert backoff.failed(0.0, 0.0) == 1.0


@pytest.mark.parametrize("wrong", [{"first_s": 0.0}, {"factor": 0.5}, {"jitter": 1.0}, {"max_s": 0.1}])
def test_a_policy_without_sense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="back-off"):
        BackoffPolicy(**wrong)


@given(st.lists(st.tuples(st.floats(0, 100), st.floats(0, 1, exclude_max=True)), max_size=50))
def test_the_wait_is_always_positive_and_bounded(failures: list[tuple[float, float]]) -> None:
    backoff = Backoff(POLICY)
    for ran_for_s, random_unit in failures:
        assert 0.5 <= backoff.failed(ran_for_s, random_unit) <= POLICY.max_s
