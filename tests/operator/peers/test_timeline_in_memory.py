"""The operator keeps a timeline of each set-up, also of one that failed before there was a connection."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.words.errors import ConnectionFailed


async def test_a_connection_tells_its_moments_up_to_the_first_value(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=5)
        battery = connection.receivable("battery")
        await battery.wait_open(5)
        world.robot.channels["battery"].deliver(b'{"percent": 80}', seq=1, stamp_us=1)
        moments = [mark.moment for mark in connection.timeline.marks]
        assert moments == [
            "asked", "granted", "offered", "answered", "ice", "dtls", "control", "hello", "catalogue", "value",
        ]  # fmt: skip
        assert connection.timeline.marks[-1].detail == "battery"
        assert connection.timeline.code == ""
        await connection.close()
        assert connection.timeline.code == "peer.closed"


async def test_an_attempt_that_failed_is_kept_with_its_code(world: Any) -> None:
    world.server.answers = False

    async with world.operator() as operator:
        with pytest.raises(ConnectionFailed):
            await operator.connect(world.robot_id, timeout_s=0.3)
        timeline = operator.timelines[world.robot_id]
        assert [mark.moment for mark in timeline.marks] == ["asked", "granted", "offered"]
        assert timeline.code == "signal.no_answer"
