"""An operator whose clocks are an hour wrong drives, stops and is stopped like any other."""

from __future__ import annotations

import time
from typing import Any

import pytest

from mosaic_core.operator.delivery.data_port import now_us

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(60)]

TIMEOUT_S = 0.3
MARGIN_S = 0.5


@pytest.mark.parametrize("skew_s", [3600, -3600], ids=["ahead", "behind"])
def test_an_hour_of_clock_skew_changes_nothing(
    site: Any, until: Any, monkeypatch: pytest.MonkeyPatch, skew_s: int
) -> None:
    true_time = time.time
    monkeypatch.setattr(time, "time", lambda: true_time() + skew_s)
    skew_us = max(skew_s * 1_000_000, -now_us() // 2)  # a clock that counts from the machine's start is never negative

    async def body() -> None:
        async with site.connected(clock_us=lambda: now_us() + skew_us) as connection:
            await connection.control.take()
            async with site.driving(connection):
                message = await connection.receivable("pose").next_message()
            assert message.info.age_s is not None
            assert message.info.age_s < 0.5
            await until(site.track.stands, "the robot stands")
            assert site.track.silence_s() < TIMEOUT_S + MARGIN_S
            assert not connection.control.limits.get("cmd_vel") or connection.control.limits["cmd_vel"].factor == 1
            async with site.driving(connection):
                said_s = time.monotonic()
                report = await connection.control.stop()
            assert site.track.stopped_s(said_s) - said_s < MARGIN_S
            assert report.safe_s is not None
            assert 0 <= report.safe_s < MARGIN_S
            await connection.control.clear_stop()

    site.on_operators_side(body)
