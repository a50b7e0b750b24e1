"""Video over bad links into Chromium: ours beside plain aiortc, through the same emulated network.

python bench/video_links.py [ROUNDS] [--codec vp8|h264] [--height 480|720]

Pictures at 30 per second, 25 ms each way, a queue of 500 ms: 1, 3 and 8 % loss, and a bottleneck of 4, then 1, then
4 Mbit/s. A picture's age is the time from its capture to its display (same machine, same clock). Freezes are
Chromium's own count. Medians of the rounds; carry the comparison, not the figures.
"""

from __future__ import annotations

import argparse
import asyncio
import shutil
import statistics
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from playwright.async_api import async_playwright
from rich.console import Console
from rich.table import Table
from video_bench import watching
from video_bench.fan_out import FPS
from video_bench.plain_aiortc import NewestPicture, PlainAnswerer
from video_bench.scene import Image, scene

from mosaic_core import EncodingParams
from mosaic_core.adapters.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.event_loop import run_event_loop
from mosaic_core.adapters.shared_video import SharedVideo
from mosaic_core.machines.impaired_link import LinkProfile
from mosaic_core.runtime.counters import ConnectorCounters
from mosaic_core.testing.impaired_answerer import impaired
from mosaic_core.testing.impaired_path import ImpairedPath

SIZES = {480: (640, 480), 720: (1280, 720)}
DELAY_MS, QUEUE_MS = 25, 500
SETTLE_S = 8.0
"""Both ramp up; what is compared is how they hold."""
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
QUIET = ["--no-sandbox", "--autoplay-policy=no-user-gesture-required", "--disable-features=WebRtcHideLocalIpsWithMdns"]


@dataclass(frozen=True, slots=True)
class Phase:
    name: str
    seconds: float
    loss: float = 0.0
    rate_mbps: float | None = None


@dataclass(frozen=True, slots=True)
class Watched:
    """What Chromium saw of one phase."""

    fps: float
    freezes_per_minute: float
    frozen_share: float
    age_p50_ms: float
    age_p95_ms: float
    mbps: float
    height: int


LOSSES = [[Phase(f"{share} % loss", 20.0, loss=share / 100)] for share in (1, 3, 8)]
STEPS = [
    Phase("4 Mbit/s", 10.0, rate_mbps=4),
    Phase("falls to 1 Mbit/s", 20.0, rate_mbps=1),
    Phase("rises to 4 Mbit/s", 20.0, rate_mbps=4),
]
RUNS = [*LOSSES, STEPS]


class Listener:
    """An ``AnswererListener``; with a stream it watches as soon as it is connected."""

    def __init__(self, stream: SharedVideo | None) -> None:
        self._stream = stream
        self.origin: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def track_bound(self, label: str) -> Any:
        assert self._stream is not None
        return self._stream.bind("page", print)

    def state_changed(self, state: str) -> None:
        if state == "connected" and self._stream is not None:
            self._stream.watch("page", True)

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        if not self.origin.done():
            self.origin.set_result(rtp_origin)

    def candidate_found(self, candidate: Any) -> None: ...
    def channel_opened(self, channel: Any) -> None: ...
    def tracks_unbound(self, labels: Any) -> None: ...
    def voice_bound(self, label: str, sound: Any) -> None: ...


async def watched(browser: Any, way: str, codec: str, pictures: list[Image], phases: list[Phase]) -> list[Watched]:
    """One connection through all ``phases``."""
    page = await browser.new_page()
    stream = SharedVideo("front", EncodingParams(codec=codec), ConnectorCounters())
    newest = NewestPicture()
    listener = Listener(stream if way == "ours" else None)
    make = AiortcAnswerer if way == "ours" else lambda told, _: PlainAnswerer(told, newest, codec)
    post = stream.post if way == "ours" else newest.post
    with ImpairedPath(_profile(phases[0])) as path:
        answerer = impaired(make, path)(listener, ())
        answer = await answerer.answer(await page.evaluate(watching.OFFER), ["front"], None)
        await page.evaluate(watching.ACCEPT, answer)
        end = filming(pictures, post)
        try:
            origin = await asyncio.wait_for(listener.origin, 30)
            await asyncio.sleep(SETTLE_S)
            return [await _phase(page, origin, path, phase) for phase in phases]
        finally:
            end()
            await answerer.close()
            stream.close()
            await page.close()


async def _phase(page: Any, origin: int, path: ImpairedPath, phase: Phase) -> Watched:
    path.become(_profile(phase))
    await watching.ages_ms(page, origin)
    before = await watching.moment(page)
    await asyncio.sleep(phase.seconds)
    after = await watching.moment(page)
    ages = await watching.ages_ms(page, origin) or [float("nan"), float("nan")]
    seconds = after.at_s - before.at_s
    return Watched(
        (after.decoded - before.decoded) / seconds,
        (after.freezes - before.freezes) * 60 / seconds,
        (after.frozen_s - before.frozen_s) / seconds,
        statistics.median(ages),
        statistics.quantiles(ages, n=20)[-1],
        (after.size_bytes - before.size_bytes) * 8 / seconds / 1e6,
        after.height,
    )


def _profile(phase: Phase) -> LinkProfile:
    return LinkProfile(phase.name, delay_ms=DELAY_MS, loss=phase.loss, rate_mbps=phase.rate_mbps, queue_ms=QUEUE_MS)


def filming(pictures: list[Image], post: Callable[[Image, float], object]) -> Callable[[], None]:
    """Post pictures at their time, on a thread; returns what ends it."""
    is_over = threading.Event()

    def film() -> None:
        began_s, number = time.monotonic(), 0
        while not is_over.wait(max(0.0, began_s + number / FPS - time.monotonic())):
            post(pictures[number % len(pictures)], time.monotonic())
            number += 1

    thread = threading.Thread(target=film)
    thread.start()

    def end() -> None:
        is_over.set()
        thread.join()

    return end


async def measure(rounds: int, codec: str, size: tuple[int, int]) -> dict[tuple[str, str], list[Watched]]:
    pictures, found = scene(*size), defaultdict(list)
    program = next((path for name in CHROMIUMS if (path := shutil.which(name))), None)
    if program is None:
        raise SystemExit("no Chromium found: install the package `chromium`")
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=program, args=QUIET)
        for _ in range(rounds):
            for phases in RUNS:
                for way in ("ours", "aiortc"):
                    for phase, seen in zip(phases, await watched(browser, way, codec, pictures, phases), strict=True):
                        found[phase.name, way].append(seen)
        await browser.close()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("rounds", nargs="?", type=int, default=3)
    parser.add_argument("--codec", choices=("vp8", "h264"), default="vp8")
    parser.add_argument("--height", type=int, choices=tuple(SIZES), default=720)
    wanted = parser.parse_args()
    size = SIZES[wanted.height]
    found = run_event_loop(measure(wanted.rounds, wanted.codec, size))
    what = f"{size[0]}x{size[1]} at 30 per second, {wanted.codec.upper()}"
    table = Table(title=f"{what}, {DELAY_MS} ms each way, into Chromium")
    for name in ("link", "way", "fps", "freezes/min", "frozen %", "age p50 ms", "p95", "Mbit/s", "height"):
        table.add_column(name, justify="left" if name in ("link", "way") else "right")
    for (link, way), runs in found.items():
        fps, freezes, frozen, p50, p95, mbps, height = (
            statistics.median(getattr(run, name) for run in runs) for name in Watched.__dataclass_fields__
        )
        row = (f"{fps:.1f}", f"{freezes:.1f}", f"{frozen:.1%}", f"{p50:.0f}", f"{p95:.0f}", f"{mbps:.2f}")
        table.add_row(link, way, *row, f"{height:.0f}")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
