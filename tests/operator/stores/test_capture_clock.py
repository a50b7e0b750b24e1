"""RTP timestamps become times of the robot's clock, across every wrap."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.capture_clock import RTP_MODULUS, capture_us

HOURS_6_US = 6 * 3_600_000_000


@given(st.integers(0, 10**13), st.integers(0, RTP_MODULUS - 1), st.integers(-HOURS_6_US, HOURS_6_US))
def test_the_capture_time_comes_back_however_often_the_counter_has_wrapped(
    captured_us: int, origin: int, error_us: int
) -> None:
    timestamp = (captured_us * 9 // 100 + origin) % RTP_MODULUS
    assert abs(capture_us(timestamp, origin, captured_us + error_us) - captured_us) <= 12
