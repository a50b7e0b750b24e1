"""What waits for a slow reader: bounded, in order, and what is lost is the oldest, and counted."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.backlog import Backlog

BOUND = 20


@given(st.lists(st.one_of(st.integers(0, 30), st.none()), max_size=60))
def test_whatever_comes_the_newest_stay_in_order_within_the_bound(steps: list[int | None]) -> None:
    """Each step puts an item of that size, or takes one (``None``)."""
    backlog: Backlog[int] = Backlog(BOUND)
    waiting: list[tuple[int, int]] = []
    lost = 0
    for number, size in enumerate(steps):
        if size is None:
            expected = waiting.pop(0)[0] if waiting else None
            assert backlog.take() == expected
        elif size > BOUND:
            backlog.put(number, size)
            lost += 1
        else:
            backlog.put(number, size)
            waiting.append((number, size))
            while sum(one for _, one in waiting) > BOUND:
                waiting.pop(0)
                lost += 1
        assert len(backlog) == len(waiting)
        assert backlog.size_bytes == sum(one for _, one in waiting) <= BOUND
        assert backlog.dropped == lost
    assert [backlog.take() for _ in waiting] == [number for number, _ in waiting]
    assert backlog.take() is None
