"""From the camera to the eye: the age of displayed pictures in Chromium, read from the pictures themselves.

python bench/glass_to_glass.py [--quick] [--rounds N] [--seconds S] [--codec C] [--only sessions dashboard links]

Every sender burns the time of capture into its pictures; a page of Chromium reads it back from the displayed <video>,
when `requestVideoFrameCallback` says for when it is on the screen. All processes of a machine have the same monotonic
clock; the page's own is calibrated against it, and how far that may be wrong is printed. Ways alternate within each
round. Differences below 17 ms, one vsync, are noise. The full run takes eight minutes; `--seconds 60` has every bad
network for a minute, which takes twelve.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import tempfile
from collections import defaultdict
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from glass_bench import bad_links
from glass_bench.dashboard import Server, compared
from glass_bench.figures import Displayed, ages_ms, freezes_per_minute, rank
from glass_bench.page import FLAGS
from glass_bench.senders import AIORTC, OURS, WAYS, Shot, Way, missing
from glass_bench.sessions import session
from playwright.async_api import async_playwright
from processes.browser import chromium
from processes.mosaic import end_like_ctrl_c
from rich.console import Console
from rich.table import Table

SIZES = ((640, 480), (1280, 720))
PARTS = ("sessions", "dashboard", "links")
PROMISED_MS = 10.0
"""Between the age that the dashboard shows and the burnt-in one."""
VSYNC_MS = 17.0


class Bench:
    def __init__(self, browser: Any, other_browser: Any, console: Console, *, is_quick: bool) -> None:
        self._browser, self._other_browser, self._console = browser, other_browser, console
        self._sizes = SIZES[-1:] if is_quick else SIZES
        self._losses = bad_links.LOSSES[1:2] if is_quick else bad_links.LOSSES
        self._worst_clock_ms = 0.0
        self.missed: list[str] = []

    # -- ways ----------------------------------------------------------------------------------------------------

    async def sessions(self, rounds: int, settle_s: float, seconds: float) -> None:
        ways = [way for way in WAYS if self._is_here(way)]
        found: dict[tuple[Way, tuple[int, int]], list[list[Displayed]]] = defaultdict(list)
        for number in range(rounds):
            for size in self._sizes:
                # Every other round backwards: who comes first isn't always the same.
                for way in ways if number % 2 == 0 else reversed(ways):
                    try:
                        found[way, size].append(await self._watched(Shot(way, size), settle_s, seconds))
                    except TimeoutError as error:
                        self._console.print(f"A session is missing: {error}")
        for size in self._sizes:
            self._console.print(self._sessions_table(size, rounds, {way: found[way, size] for way in ways}))
        self._console.print(
            f"The page's clock is at most {self._worst_clock_ms:.1f} ms off; differences below {VSYNC_MS:.0f} ms "
            f"(one vsync) are noise.\n"
        )

    def _is_here(self, way: Way) -> bool:
        why = missing(way)
        if why is not None:
            self._console.print(f"{way.name}: skipped, {why}")
        return why is None

    async def _watched(self, shot: Shot, settle_s: float, seconds: float) -> list[Displayed]:
        async with session(self._browser, self._other_browser, shot) as one:
            self._worst_clock_ms = max(self._worst_clock_ms, 1000 * one.clock.error_s)
            await one.displayed(settle_s)
            return await one.displayed(seconds)

    def _sessions_table(self, size: tuple[int, int], rounds: int, found: dict[Way, list[list[Displayed]]]) -> Table:
        table = Table(title=f"Glass to glass in Chromium, {size[0]}x{size[1]} at 30 per second; sessions: {rounds}")
        for name in ("way", "p50 ms", "p95 ms", "p50 of each session", "fps", "freezes/min", "height"):
            table.add_column(name, justify="left" if name == "way" else "right")
        for way, sessions in ((way, sessions) for way, sessions in found.items() if sessions):
            ages = [age for pictures in sessions for age in ages_ms(pictures)]
            each = " ".join(f"{rank(ages_ms(pictures), 0.5):.0f}" for pictures in sessions)
            fps, freezes = (_mean(figure(pictures) for pictures in sessions) for figure in (_fps, _freezes))
            heights = sorted({picture.height for pictures in sessions for picture in pictures}, reverse=True)
            row = (f"{rank(ages, 0.5):.0f}", f"{rank(ages, 0.95):.0f}", each, f"{fps:.1f}", f"{freezes:.1f}")
            table.add_row(way.name, *row, " ".join(map(str, heights)))
        return table

    # -- the dashboard -------------------------------------------------------------------------------------------

    async def dashboard(self, settle_s: float, seconds: float) -> None:
        table = Table(title=f"The age that the dashboard shows, less the burnt-in one; promised: {PROMISED_MS:.0f} ms")
        for name in ("picture", "burnt in p50 / p95 ms", "difference p50 ms", "|difference| p95 ms", "text p50 ms", ""):
            table.add_column(name, justify="left" if name in ("picture", "") else "right")
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            server = await asyncio.to_thread(Server, Path(folder), stack)
            for size in self._sizes:
                pictures, texts = await compared(self._browser, server, size, settle_s, seconds)
                table.add_row(f"{size[0]}x{size[1]}", *self._difference_cells(pictures, texts))
        self._console.print(table)
        self._console.print(
            "Text: what stood over the picture, a median of a second, less that of the burnt-in ages.\n"
        )

    def _difference_cells(self, pictures: list[Displayed], texts: list[tuple[float, float]]) -> list[str]:
        ages = ages_ms(pictures)
        differences = differences_ms(pictures)
        of_texts = text_differences_ms(pictures, texts)
        p95 = rank([abs(value) for value in differences], 0.95)
        is_kept = bool(differences) and p95 <= PROMISED_MS
        if not is_kept:
            self.missed.append(f"the dashboard's age is {p95:.0f} ms off")
        return [
            f"{rank(ages, 0.5):.0f} / {rank(ages, 0.95):.0f}",
            f"{rank(differences, 0.5):+.1f}",
            f"{p95:.1f}",
            f"{rank(of_texts, 0.5):+.1f}",
            "kept" if is_kept else "MISSED",
        ]

    # -- bad networks --------------------------------------------------------------------------------------------

    async def links(self, seconds: float, codec: str) -> None:
        ways = [replace(way, codec=codec) for way in (OURS, AIORTC)]
        found = await bad_links.seen_by(self._browser, ways, self._losses, seconds)
        width, height = bad_links.SIZE
        self._console.print(f"{width}x{height}, {bad_links.DELAY_MS:.0f} ms each way, {seconds:.0f} s of each:\n")
        for line in bad_links.table_lines(found):
            self._console.print(line, markup=False, soft_wrap=True)
        self._console.print(
            "\nWell again: narrower, until the ages are within 100 ms of those before the step, without freezes, for "
            "two seconds; wider, until for two seconds 80 % of the bit rate before the first step came. Drift: the "
            "last third's median age less the first third's."
        )


def differences_ms(pictures: list[Displayed]) -> list[float]:
    """Told age less burnt-in age of every picture that has both."""
    return [1000 * (one.told_age_s - one.age_s) for one in pictures if None not in (one.told_age_s, one.age_s)]  # type: ignore[operator]


def text_differences_ms(pictures: list[Displayed], texts: list[tuple[float, float]]) -> list[float]:
    """Each text less the median of the burnt-in ages of the second before it."""
    found = []
    for at_s, shown_ms in texts:
        ages = ages_ms([picture for picture in pictures if at_s - 1 <= picture.at_s < at_s])
        if ages and at_s - 1 >= pictures[0].at_s:
            found.append(shown_ms - rank(ages, 0.5))
    return found


def _fps(pictures: list[Displayed]) -> float:
    return (len(pictures) - 1) / (pictures[-1].at_s - pictures[0].at_s) if len(pictures) > 1 else 0.0


def _freezes(pictures: list[Displayed]) -> float:
    return freezes_per_minute(pictures, pictures[0].at_s, pictures[-1].at_s + 1e-6) if len(pictures) > 1 else 0.0


def _mean(values: Any) -> float:
    listed = list(values)
    return float(sum(listed) / len(listed))


async def measure(asked: argparse.Namespace, console: Console) -> list[str]:
    program = chromium()
    if program is None:
        raise SystemExit("no Chromium found: apt install chromium, or name one in MOSAIC_CHROMIUM")
    async with async_playwright() as playwright:
        # Two, so that a sending page and the one that displays are processes of their own.
        browser, other = [await playwright.chromium.launch(executable_path=program, args=FLAGS) for _ in range(2)]
        bench = Bench(browser, other, console, is_quick=asked.quick)
        if "sessions" in asked.only:
            await bench.sessions(asked.rounds, 1.0 if asked.quick else 3.0, 1.5 if asked.quick else 3.0)
        if "dashboard" in asked.only:
            await bench.dashboard(2.0 if asked.quick else 4.0, 3.0 if asked.quick else 8.0)
        if "links" in asked.only:
            await bench.links(asked.seconds, asked.codec)
        await browser.close()
        await other.close()
        return bench.missed


def main() -> None:
    end_like_ctrl_c()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="90 seconds: does it work at all?")
    parser.add_argument("--rounds", type=int, help="sessions of each way and size (2; quick: 1)")
    parser.add_argument("--seconds", type=float, help="of each bad network (12; quick: 3)")
    parser.add_argument("--codec", choices=("vp8", "h264"), default="vp8", help="of the bad networks")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    asked = parser.parse_args()
    asked.rounds = asked.rounds or (1 if asked.quick else 2)
    asked.seconds = asked.seconds or (3.0 if asked.quick else 12.0)
    console = Console(width=120)
    console.print(f"Load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    try:
        missed = asyncio.run(measure(asked, console))
    except KeyboardInterrupt:
        raise SystemExit("interrupted") from None
    if missed:
        raise SystemExit("; ".join(missed))


if __name__ == "__main__":
    main()
