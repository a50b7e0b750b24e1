"""What a robot has to do besides, and what its plugins do wrong, keeps it neither from falling still nor from a stop.

The bounds are generous, for machines that have other work; bench/control.py measures what they are.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(90)]

TIMEOUT_S = 0.3
BLOCKED_S = 1.4
"""Several time-outs, but not yet the two seconds after which the operator gives the robot up."""
STOPS = 20
LEAST_BULK_BPS = 4_000_000
"""Or there was none beside; it gives way to all else on a busy machine."""
BOUND_S = 0.8
"""For a stop or a standstill by silence, on top of ``timeout_s``, beside everything that this module starts."""


@pytest.fixture
def burners() -> Iterator[None]:
    """Every core has something better to do."""
    words = [sys.executable, "-c", "import os\nparent = os.getppid()\nwhile os.getppid() == parent: sum(range(100000))"]
    running = [subprocess.Popen(words) for _ in range(os.cpu_count() or 1)]
    yield
    for burner in running:
        burner.kill()
        burner.wait()


async def stops_by_silence_and_by_word(site: Any, until: Any, connection: Any) -> None:
    for _ in range(STOPS // 2):
        async with site.driving(connection):
            pass
        await until(site.track.stands, "the robot stands")
        assert site.track.silence_s() < TIMEOUT_S + BOUND_S
    for _ in range(STOPS):
        async with site.driving(connection):
            said_s = time.monotonic()
            await connection.control.stop("test")
            await until(lambda since_s=said_s: site.track.has_stopped(since_s), "it stands")
            assert site.track.stopped_s(said_s) - said_s < BOUND_S
        await connection.control.clear_stop()


def test_a_plugin_that_blocks_the_event_loop_does_not_keep_the_robot_moving(site: Any, until: Any) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take()
            blocker = connection.sendable("blocker")
            await blocker.wait_open()
            async with site.driving(connection):
                blocked_s = time.monotonic()
                assert blocker.send_data(str(BLOCKED_S))
                await until(lambda: site.track.has_stopped(blocked_s), "it stands while its loop is blocked", BLOCKED_S)
            stopped_s = site.track.stopped_s(blocked_s)
            assert stopped_s - blocked_s < TIMEOUT_S + BOUND_S
            await connection.receivable("pose").next_message()
            assert stopped_s < time.monotonic() - BLOCKED_S / 2
            assert site.track.moves(stopped_s) == [], "what had waited meanwhile is too old"
            async with site.driving(connection):
                pass

    site.on_operators_side(body)


def test_on_a_saturated_machine_silence_and_a_stop_still_stop_the_robot(site: Any, until: Any, burners: None) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take()
            await stops_by_silence_and_by_word(site, until, connection)

    site.on_operators_side(body)


def test_beside_bulk_that_takes_all_it_gets_silence_and_a_stop_still_stop_the_robot(site: Any, until: Any) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take()
            bulk = connection.receivable("bulk")
            arrived: list[int] = []
            bulk.subscribe(lambda data: arrived.append(len(data)))
            await bulk.next_message()
            start_s = time.monotonic()
            await stops_by_silence_and_by_word(site, until, connection)
            assert sum(arrived) > LEAST_BULK_BPS / 8 * (time.monotonic() - start_s)

    site.on_operators_side(body)
