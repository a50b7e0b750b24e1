"""A recording plays at its own pace."""

from __future__ import annotations

from datetime import time
from types import SimpleNamespace

import pytest

from mosaic_sensors.nmea_stream import MAX_GAP_S, UNTIMED_EPOCH_S, Pace


def timed(hour: int, minute: int, second: int, microsecond: int = 0) -> SimpleNamespace:
    return SimpleNamespace(msgID="GGA", time=time(hour, minute, second, microsecond))


def test_the_pace_is_that_of_the_times_in_the_recording() -> None:
    pace = Pace()

    assert pace.wait_s(timed(10, 0, 0)) == 0
    assert pace.wait_s(timed(10, 0, 0)) == 0
    assert pace.wait_s(timed(10, 0, 0, 200_000)) == pytest.approx(0.2)
    assert pace.wait_s(None) == 0
    assert pace.wait_s(SimpleNamespace(msgID="GSA")) == 0


def test_midnight_is_no_gap_and_a_gap_is_not_waited_out() -> None:
    pace = Pace()
    pace.wait_s(timed(23, 59, 59))

    assert pace.wait_s(timed(0, 0, 0)) == pytest.approx(1.0)
    assert pace.wait_s(timed(12, 0, 0)) == MAX_GAP_S
    assert pace.wait_s(timed(11, 0, 0)) == MAX_GAP_S


def test_a_receiver_that_does_not_know_the_time_speaks_once_a_second() -> None:
    assert Pace().wait_s(SimpleNamespace(msgID="GGA", time="")) == UNTIMED_EPOCH_S
