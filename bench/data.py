"""Data channels: throughput, small messages, round trips; ours beside plain aiortc, Chromium and native libwebrtc.

python bench/data.py [--rounds N] [--seconds S] [--only throughput messages round-trip]

Both ends are processes of their own on one machine. Two pages of one Chromium share the process that owns
their sockets, and nothing was lost in the kernel there; two Chromiums have one each, as on two machines. One ordered,
reliable channel; ways alternate within each round, and the median of the rounds counts. What is compared is the rate of
a flow that runs; how long each way needed for its first 2000 messages is a column of its own. Native libwebrtc is
measured after `pip install wrtc`.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import shutil
import statistics
import time
from collections.abc import Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from data_bench.ends import PageEnd, ProcessEnd, RemoteEnd
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

WARM_UP_S = 1.0
WARM_UP_MESSAGES = 2000
WARM_UP_MOST_S = 20.0
"""A page's first burst overflows the 64 KiB that Chromium lets a renderer have under way to its socket: hundreds of
packets are lost at once, and for the next 2 to 10 s it sends 0.1 to 0.6 MB/s. One second of warm-up sees only that."""
POLL_S = 0.1
BLOCK_BYTES = 16 * 1024
MESSAGE_BYTES = 100
MEASURES = ("throughput", "messages", "round-trip")
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-features=WebRtcHideLocalIpsWithMdns", "--no-first-run"]
PAGES = ("page", "other page")
PLAIN = "plain aiortc"
BROWSERS = "Chromium → Chromium"


@dataclass(frozen=True, slots=True)
class Way:
    """Who offers (and then receives a flood) and who answers (and sends it): `stack/loop`, `page`, or `other page` in a
    Chromium of its own."""

    name: str
    receiver: str
    sender: str


WAYS = (
    Way(PLAIN, "aiortc/asyncio", "aiortc/asyncio"),
    Way("plain aiortc on uvloop", "aiortc/uvloop", "aiortc/uvloop"),
    Way("ours", "ours/uvloop", "ours/uvloop"),
    Way("ours on asyncio", "ours/asyncio", "ours/asyncio"),
    Way("plain aiortc → Chromium", "page", "aiortc/asyncio"),
    Way("ours → Chromium", "page", "ours/uvloop"),
    Way(BROWSERS, "page", "page"),
    Way("Chromium → another Chromium", "page", "other page"),
    Way("native libwebrtc", "wrtc/asyncio", "wrtc/asyncio"),
)


class Pair:
    """Two connected ends."""

    def __init__(self, receiver: RemoteEnd, sender: RemoteEnd) -> None:
        self.receiver, self.sender = receiver, sender

    async def connect(self) -> None:
        answer = await self.sender.do("answer", sdp=await self.receiver.do("offer"))
        await self.receiver.do("accept", sdp=answer)
        await asyncio.gather(self.receiver.do("opened"), self.sender.do("opened"))

    async def close(self) -> None:
        for end in (self.receiver, self.sender):
            await end.do("close")
            await end.stop()


Browsers = dict[str, Any]
"""The Chromium of each kind of page; empty where there is none."""


async def started(kind: str, browsers: Browsers) -> RemoteEnd:
    if kind in PAGES:
        return await PageEnd.started(browsers[kind])
    return await ProcessEnd.started(*kind.split("/"))


async def connected(way: Way, browsers: Browsers) -> Pair:
    pair = Pair(await started(way.receiver, browsers), await started(way.sender, browsers))
    await pair.connect()
    return pair


async def warmed_up(pair: Pair) -> float:
    """Wait until the flow runs; seconds until its first `WARM_UP_MESSAGES` were there, infinite if they never were."""
    start_s = time.monotonic()
    took_s = math.inf
    while took_s == math.inf and time.monotonic() - start_s < WARM_UP_MOST_S:
        await asyncio.sleep(POLL_S)
        if (await pair.receiver.do("count"))[0] >= WARM_UP_MESSAGES:
            took_s = time.monotonic() - start_s
    await asyncio.sleep(max(0.0, start_s + WARM_UP_S - time.monotonic()))
    return took_s


async def flooded(pair: Pair, size_bytes: int, seconds: float) -> tuple[float, ...]:
    """Messages and MB per second at the receiver, the sender's CPU in µs per message (NaN in a browser), and the
    seconds of :func:`warmed_up`."""
    await pair.sender.do("flood", size_bytes=size_bytes)
    start_s = await warmed_up(pair)
    cpu_0 = (await pair.sender.do("count"))[3]
    messages_0, bytes_0, from_s, _ = await pair.receiver.do("count")
    await asyncio.sleep(seconds)
    messages, size, until_s, _ = await pair.receiver.do("count")
    cpu = (await pair.sender.do("count"))[3]
    lasted_s, came = until_s - from_s, messages - messages_0
    cpu_us = float("nan") if cpu is None else 1e6 * (cpu - cpu_0) / max(1, came)
    return came / lasted_s, (size - bytes_0) / lasted_s / 1e6, cpu_us, start_s


async def pinged(pair: Pair, seconds: float) -> tuple[float, ...]:
    """Round trip in ms at 50 Hz and at 1 kHz, p50 and p99 each."""
    await pair.receiver.do("echo")
    figures: list[float] = []
    for rate_hz in (50, 1000):
        trips = await pair.sender.do("ping", rate_hz=rate_hz, count=round(rate_hz * seconds), size_bytes=MESSAGE_BYTES)
        ordered = sorted(trips)
        figures += [statistics.median(ordered), ordered[round(0.99 * (len(ordered) - 1))]]
    return tuple(figures)


async def measured(measure: str, way: Way, browsers: Browsers, seconds: float) -> tuple[float, ...]:
    pair = await connected(way, browsers)
    try:
        if measure == "round-trip":
            return await pinged(pair, seconds)
        return await flooded(pair, BLOCK_BYTES if measure == "throughput" else MESSAGE_BYTES, seconds)
    finally:
        await pair.close()


# -- what is shown -----------------------------------------------------------------------------------------------------

Figures = dict[str, list[tuple[float, ...]]]


def medians(rounds: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(statistics.median(column) for column in zip(*rounds, strict=True))


def speed_table(title: str, figures: Figures, column: int, unit: str, digits: int) -> Table:
    start = f"s until {WARM_UP_MESSAGES} had come"
    table = Table("way", unit, f"x {PLAIN}", f"x {BROWSERS}", "µs CPU a message, sender", start, title=title)
    rates = {name: medians(rounds) for name, rounds in figures.items()}
    for name, rate in rates.items():
        ratios = [f"{rate[column] / rates[peer][column]:.2f}" if peer in rates else "–" for peer in (PLAIN, BROWSERS)]
        cpu = f"{rate[2]:.0f}" if rate[2] == rate[2] else "–"
        table.add_row(name, f"{rate[column]:,.{digits}f}".replace(",", " "), *ratios, cpu, f"{rate[3]:.1f}")
    return table


def trip_table(figures: Figures) -> Table:
    table = Table(
        "way", "50 Hz: p50 / p99 ms", "1 kHz: p50 / p99 ms", f"p50 at 1 kHz x {PLAIN}", title="Round trip, 100 bytes"
    )
    trips = {name: medians(rounds) for name, rounds in figures.items()}
    for name, (slow, slow_99, fast, fast_99) in trips.items():
        ratio = f"{fast / trips[PLAIN][2]:.2f}" if PLAIN in trips else "–"
        table.add_row(name, f"{slow:.2f} / {slow_99:.2f}", f"{fast:.2f} / {fast_99:.2f}", ratio)
    return table


def shown(measure: str, figures: Figures) -> Table:
    if measure == "throughput":
        return speed_table("Throughput, messages of 16 KiB", figures, 1, "MB/s", 1)
    if measure == "messages":
        return speed_table("Small messages, 100 bytes", figures, 0, "messages/s", 0)
    return trip_table(figures)


async def run(options: argparse.Namespace, console: Console) -> None:
    async with AsyncExitStack() as stack:
        browsers = await _browsers(stack)
        ways = [way for way in WAYS if _is_possible(way, browsers) and (not options.ways or way.name in options.ways)]
        console.print(f"Load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        for measure in options.only or MEASURES:
            figures: Figures = {way.name: [] for way in ways}
            with Progress(console=console, transient=True) as progress:
                bar = progress.add_task(measure, total=options.rounds * len(ways))
                for _ in range(options.rounds):
                    for way in ways:
                        figures[way.name].append(await measured(measure, way, browsers, options.seconds))
                        progress.advance(bar)
            console.print(shown(measure, figures))


def _is_possible(way: Way, browsers: Browsers) -> bool:
    ends = {way.receiver, way.sender}
    has_wrtc = find_spec("wrtc") is not None
    return (bool(browsers) or ends.isdisjoint(PAGES)) and (has_wrtc or "wrtc/asyncio" not in ends)


async def _browsers(stack: AsyncExitStack) -> Browsers:
    path = next(filter(None, map(shutil.which, CHROMIUMS)), None)
    if path is None or find_spec("playwright") is None:
        return {}
    from playwright.async_api import async_playwright

    playwright = await stack.enter_async_context(async_playwright())
    browsers: Browsers = {}
    for kind in PAGES:
        browsers[kind] = await playwright.chromium.launch(executable_path=path, args=FLAGS)
        stack.push_async_callback(browsers[kind].close)
    return browsers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=3.0, help="of each measurement (3)")
    parser.add_argument("--only", nargs="+", choices=MEASURES)
    parser.add_argument("--ways", nargs="+", choices=[way.name for way in WAYS])
    asyncio.run(run(parser.parse_args(), Console()))


if __name__ == "__main__":
    main()
