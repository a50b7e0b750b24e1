"""What an operator reports about its link, however absurd, slows it down at most."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mosaic_core.runtime.commands import link_watch
from mosaic_core.runtime.commands.link_watch import MeasuredLink
from mosaic_core.words.limits import SlowDownCurves


@pytest.mark.parametrize("capture_us", [10**400, -(10**400), -1, 0, 2**63])
def test_a_picture_captured_at_any_time_is_taken_for_one_of_now_or_before(capture_us: int) -> None:
    link = MeasuredLink()
    link.picture_seen("front", capture_us)
    factor, _ = link.speed(SlowDownCurves())
    assert 0.0 <= factor <= 1.0


@pytest.mark.parametrize("t0_us", [10**400, -(10**400), 0])
def test_an_answer_to_a_ping_that_nobody_sent_is_ignored(t0_us: int) -> None:
    link = MeasuredLink()
    link.ponged(t0_us)
    assert link.speed(SlowDownCurves()) == (1.0, ())


def test_a_ping_says_when_it_was_sent_in_microseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_watch, "time", SimpleNamespace(monotonic=lambda: 1000.0))
    assert MeasuredLink().pinged().t0 == 1_000_000_000
