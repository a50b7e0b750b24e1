"""Operators that come, see a picture and go, over and over; and what the robot keeps of them."""

from __future__ import annotations

import asyncio
import json
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from processes.mosaic import Site, token_once_ready

from glass_bench.dashboard import Server
from mosaic_core.operator import MosaicOperator

SIZE = (320, 240)
STAY_S = (0.2, 1.0)
FIRST_PICTURE_S = 30.0
QUIET_LOOKS = 12
"""Looks in a row, four a second, in which nothing ends any more."""
QUIET_WITHIN_S = 60.0


@dataclass(frozen=True, slots=True)
class Kept:
    """By the robot's process."""

    rss_mb: float
    threads: int
    tasks: int
    files: int
    """Sockets and files that are open."""
    encoders: tuple[str, ...] = ()


class CountedRobot:
    """Follows what the process writes."""

    def __init__(self, log: Path) -> None:
        self._log = log

    def looks(self) -> list[Kept]:
        """All so far, the oldest first."""
        found = []
        for line in self._log.read_text().splitlines():
            with suppress(json.JSONDecodeError, TypeError):  # a line that is still being written, or a log line
                words = json.loads(line)
                found.append(
                    Kept(words["rss_mb"], words["threads"], words["tasks"], words["files"], tuple(words["encoders"]))
                )
        return found

    async def at_rest(self) -> Kept:
        """What it keeps once everybody is gone. Raises :class:`TimeoutError` if an encoder never ends."""
        seen, ends_at_s = len(self.looks()), time.monotonic() + QUIET_WITHIN_S
        while True:
            last = self.looks()[seen:][-QUIET_LOOKS:]
            is_quiet = len({(look.threads, look.tasks, look.files) for look in last}) == 1 and not any(
                k.encoders for k in last
            )
            if len(last) == QUIET_LOOKS and is_quiet:
                return last[-1]
            if time.monotonic() > ends_at_s:
                raise TimeoutError(f"the robot does not come to rest: {last[-1:]}")
            await asyncio.sleep(0.25)


@contextmanager
def counted_robot(config: Path, log: Path) -> Iterator[CountedRobot]:
    """Until the end of the block."""
    words = [sys.executable, str(Path(__file__).with_name("counted_robot.py")), str(config)]
    with log.open("wb") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT)
        try:
            yield CountedRobot(log)
        finally:
            process.terminate()
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@dataclass(frozen=True, slots=True)
class Soaked:
    """``joins`` operators between two moments of rest; ``late`` of them had no picture within half a minute."""

    joins: int
    late: int
    before: Kept
    after: Kept


async def soaked(server: Server, robot: CountedRobot, viewers: int, seconds: float, warm_up_s: float) -> Soaked:
    """First ``warm_up_s`` that do not count: libraries load, caches fill. All are signed in by one password: hashing it
    for everybody would take the processor from the robot."""
    token = await token_once_ready(server.site)
    await _crowd(server.site, token, viewers, warm_up_s)
    before = await robot.at_rest()
    joins, late = await _crowd(server.site, token, viewers, seconds)
    return Soaked(joins, late, before, await robot.at_rest())


async def _crowd(site: Site, token: str, viewers: int, seconds: float) -> tuple[int, int]:
    ends_at_s = time.monotonic() + seconds
    visits = await asyncio.gather(*(_visits(site, token, ends_at_s) for _ in range(viewers)))
    return sum(joins for joins, _ in visits), sum(late for _, late in visits)


async def _visits(site: Site, token: str, ends_at_s: float) -> tuple[int, int]:
    """One person who comes again and again: how often, and how often without seeing anything."""
    joins = late = 0
    async with MosaicOperator(site.url, token) as operator:
        while time.monotonic() < ends_at_s or joins == 0:
            connection = await operator.connect(site.robot_id)
            try:
                await connection.media("front").next_frame(FIRST_PICTURE_S)
            except TimeoutError:
                late += 1
                print(f"No picture for {FIRST_PICTURE_S:.0f} s; {connection.state}", flush=True)
            await asyncio.sleep(random.uniform(*STAY_S))
            await connection.close()
            joins += 1
    return joins, late
