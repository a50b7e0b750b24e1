"""A robot keeps nothing of operators who left; an hour of this is `bench/viewers_come_and_go.py --minutes 60`."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest
from glass_bench.dashboard import Server
from glass_bench.soak import SIZE, Soaked, counted_robot, soaked

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(180)]
VIEWERS = 3
WARM_UP_S, SOAK_S = 6.0, 12.0
GROWTH_MB = 12.0
"""Allocators round up; what leaks a peer connection per operator exceeds this in a minute."""


def test_operators_who_come_and_go_leave_no_memory_threads_or_tasks(tmp_path: Path) -> None:
    async def measured(stack: ExitStack) -> Soaked:
        server = Server(tmp_path, stack)
        robot = stack.enter_context(counted_robot(server.config(SIZE), server.site.robot_log))
        return await soaked(server, robot, VIEWERS, SOAK_S, WARM_UP_S)

    # On a thread of its own: a browser of another test may occupy this one's event loop.
    with ExitStack() as stack, ThreadPoolExecutor(1) as pool:
        found = pool.submit(asyncio.run, measured(stack)).result()
    assert found.joins >= VIEWERS
    assert found.after.threads <= found.before.threads
    assert found.after.tasks <= found.before.tasks
    assert found.after.rss_mb - found.before.rss_mb < GROWTH_MB
