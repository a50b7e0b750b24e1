"""Several cameras on one narrow link: the age of displayed pictures in Chromium, ours beside two peers.

    sudo .venv/bin/python bench/shared_link.py [--seconds 300] [--only cameras cuts ...] [--ways ours Chromium ...]
                                               [--film FILE]

A real token bucket (`tc tbf`) between two network namespaces, with a queue of 300 ms. The pictures are noise that
moves, or a film; the time of capture is burnt in and read back from the displayed <video>. The peers: Chromium →
Chromium, and aiortc as its examples use it. Ways take turns. Needs root.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from glass_bench.figures import Displayed, ages_ms, freezes_per_minute, rank
from playwright.async_api import async_playwright
from processes.browser import chromium
from processes.mosaic import end_like_ctrl_c
from rich.console import Console
from rich.table import Table
from shared_bench.link import OPERATOR_IP, SharedLink, shared_link
from shared_bench.senders import CUT, Cameras
from shared_bench.watching import Watched, chromium_in, watched

WAYS = ("ours", "Chromium", "plain aiortc")
SETTLE_S = 8.0
CUT_EVERY_S = 7.0
QUEUE_MS = 300.0
SMALL, LARGE = ((640, 480), 20.0), ((1280, 720), 30.0)


@dataclass(frozen=True, slots=True)
class Condition:
    """What is on the link."""

    name: str
    part: str
    rate_mbps: float
    count: int
    format: tuple[tuple[int, int], float] = SMALL
    robots: int = 1
    late: int = 0
    sensor_bps: float = 0.0

    @property
    def is_of_ours_alone(self) -> bool:
        return self.late > 0 or self.sensor_bps > 0.0


CONDITIONS = (
    Condition("1 camera", "cameras", 1, 1),
    Condition("2 cameras", "cameras", 1, 2),
    Condition("3 cameras", "cameras", 1, 3),
    Condition("2 large cameras", "cameras", 3, 2, LARGE),
    Condition("scene cuts", "cuts", 3, 1, LARGE),
    Condition("2 cameras, scene cuts", "cuts", 3, 2, LARGE),
    Condition("beside a TCP download", "tcp", 1, 1),
    Condition("beside a TCP download", "tcp", 3, 1, LARGE),
    Condition("beside a bulk transfer", "bulk", 1, 1),
    Condition("beside a bulk transfer", "bulk", 3, 1, LARGE),
    Condition("beside a sensor of 0.3 Mbit/s", "data", 1, 1, sensor_bps=300_000),
    Condition("a camera joins", "joins", 1, 2, late=1),
    Condition("two robots", "robots", 1, 1, robots=2),
)


@dataclass
class Measured:
    """One way under one condition."""

    cameras: list[list[Displayed]] = field(default_factory=list)
    seconds: float = 0.0
    used: float = 0.0
    """Share of the link, other traffic included."""
    others_bytes: int = 0
    events_s: list[float] = field(default_factory=list)

    def ages(self) -> list[float]:
        return [age for pictures in self.cameras for age in ages_ms(pictures)]

    @property
    def freezes(self) -> float:
        """Per minute, of the camera that has most."""
        counts = [freezes_per_minute(one, one[0].at_s, one[-1].at_s + 1e-6) for one in self.cameras if len(one) > 1]
        return max(counts, default=float("nan"))

    @property
    def longest_gap_ms(self) -> float:
        gaps = [late.at_s - early.at_s for one in self.cameras for early, late in pairwise(one)]
        return 1000 * max(gaps, default=float("nan"))

    @property
    def fps(self) -> str:
        return " ".join(f"{len(one) / self.seconds:.0f}" for one in self.cameras)


class Download:
    """One TCP connection through the same bucket that takes all that it gets, from a thread in each network."""

    def __init__(self, link: SharedLink) -> None:
        listening: socket.socket = link.operator.run(lambda: socket.create_server((OPERATOR_IP, 0)))
        self._listening, self.received = listening, 0
        self._sending: socket.socket = link.robot.run(lambda: socket.create_connection(listening.getsockname()))
        self._receiving, _ = listening.accept()
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._send, self._receive)]
        for thread in self._threads:
            thread.start()

    def end(self) -> None:
        for one in (self._sending, self._receiving):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join()
        for one in (self._sending, self._receiving, self._listening):
            one.close()

    def _send(self) -> None:
        with suppress(OSError):
            while True:
                self._sending.sendall(bytes(16_384))

    def _receive(self) -> None:
        with suppress(OSError):
            while data := self._receiving.recv(65_536):
                self.received += len(data)


async def _wait(seconds: float, every_s: float, act: Callable[[], None]) -> list[float]:
    """When ``act`` was called."""
    acted, ends_at_s = [], time.monotonic() + seconds
    while (left_s := ends_at_s - time.monotonic()) > 0:
        await asyncio.sleep(min(left_s, every_s))
        if left_s > every_s:
            acted.append(time.monotonic())
            act()
    return acted


async def measured(
    condition: Condition, way: str, seconds: float, playwright: Any, program: str, film: str = ""
) -> Measured:
    with tempfile.TemporaryDirectory() as folder, shared_link(condition.rate_mbps, QUEUE_MS) as link:
        async with AsyncExitStack() as stack:
            browsers = [
                await stack.enter_async_context(chromium_in(playwright, one, program, Path(folder)))
                for one in (link.operator, link.robot)[: 2 if way == "Chromium" else 1]
            ]
            cameras = [
                Cameras(way, condition.count, *condition.format, condition.late, number + 1, condition.sensor_bps, film)
                for number in range(condition.robots)
            ]
            robots = [await stack.enter_async_context(watched(link, browsers[0], browsers[-1], one)) for one in cameras]
            return await _measured(condition, link, robots, seconds)


async def _measured(condition: Condition, link: SharedLink, robots: Sequence[Watched], seconds: float) -> Measured:
    await asyncio.sleep(SETTLE_S)
    download = Download(link) if condition.part == "tcp" else None
    if condition.part == "bulk":
        await robots[0].transfer()
    await asyncio.sleep(SETTLE_S if download or condition.part == "bulk" else 0.0)
    for robot in robots:
        await robot.take()
    began_s, before, others = time.monotonic(), link.sent_bytes(), await _others_bytes(robots, download)
    found = Measured()
    if condition.part == "cuts":
        found.events_s = await _wait(seconds, CUT_EVERY_S, lambda: robots[0].sender.order(CUT))
    elif condition.part == "joins":
        found.events_s = (await _wait(seconds, seconds / 2, lambda: robots[0].sender.order("camera1")))[:1]
    else:
        await asyncio.sleep(seconds)
    found.seconds = time.monotonic() - began_s
    found.used = (link.sent_bytes() - before) * 8 / found.seconds / condition.rate_mbps / 1e6
    found.others_bytes = await _others_bytes(robots, download) - others
    found.cameras = [pictures for robot in robots for pictures in await robot.take()]
    if download:
        download.end()
    return found


async def _others_bytes(robots: Sequence[Watched], download: Download | None) -> int:
    """Of the download, the bulk transfer or the sensor."""
    return download.received if download else await robots[0].transferred_bytes()


def cells(condition: Condition, found: Measured) -> list[str]:
    ages, link_bytes = found.ages(), condition.rate_mbps * 1e6 / 8 * found.seconds
    more = ""
    if condition.part in ("tcp", "bulk", "data"):
        more = f"pictures have {100 * (found.used - found.others_bytes / link_bytes):.0f} % of the link"
    elif condition.part == "robots":
        more = "pictures of each: " + " : ".join(str(len(one)) for one in found.cameras)
    elif found.events_s:
        oldest = [
            max(1000 * (one.age_s or 0) for pictures in found.cameras for one in pictures if 0 <= one.at_s - at_s < 2)
            for at_s in found.events_s
        ]
        more = "oldest within 2 s after: " + " ".join(f"{age:.0f}" for age in oldest)
    return [
        f"{rank(ages, 0.5):.0f} / {rank(ages, 0.95):.0f} / {rank(ages, 1.0):.0f}", f"{found.freezes:.1f}",
        f"{found.longest_gap_ms:.0f}", found.fps, f"{100 * found.used:.0f}", more,
    ]  # fmt: skip


async def measure(asked: argparse.Namespace, console: Console) -> None:
    program = chromium()
    if program is None:
        raise SystemExit("no Chromium found: apt install chromium, or name one in MOSAIC_CHROMIUM")
    table = Table(title=f"Displayed in Chromium, {asked.seconds:.0f} s each, queue of {QUEUE_MS:.0f} ms")
    for name in ("link", "way", "p50 / p95 / oldest ms", "freezes/min", "longest gap ms", "fps", "link used %", ""):
        table.add_column(name)
    async with async_playwright() as playwright:
        for condition in (one for one in CONDITIONS if one.part in asked.only):
            for way in (one for one in asked.ways if one == "ours" or not condition.is_of_ours_alone):
                link = f"{condition.name}, {condition.format[0][1]}p on {condition.rate_mbps:g} Mbit/s"
                try:
                    found = await measured(condition, way, asked.seconds, playwright, program, asked.film)
                except TimeoutError as error:
                    console.print(f"{link}, {way}: {error}")
                    continue
                row = [link, way, *cells(condition, found)]
                console.print("  ".join(row), markup=False, soft_wrap=True)
                table.add_row(*row)
    console.print(table)


def main() -> None:
    end_like_ctrl_c()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = list(dict.fromkeys(one.part for one in CONDITIONS))
    parser.add_argument("--seconds", type=float, default=60.0, help="of each cell (60; the published table: 300)")
    parser.add_argument("--only", nargs="+", choices=parts, default=parts)
    parser.add_argument(
        "--film", default="", help="a video that ours and aiortc show instead of noise; Chromium shows none"
    )
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    asked = parser.parse_args()
    if asked.film:
        asked.ways = [way for way in asked.ways if way != "Chromium"]
    if os.geteuid() != 0:
        sys.exit("network namespaces need root: sudo .venv/bin/python bench/shared_link.py")
    console = Console(width=160)
    console.print(f"Load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    asyncio.run(measure(asked, console))


if __name__ == "__main__":
    main()
