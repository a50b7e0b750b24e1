"""A page in Chromium that watches one video, and its clock beside ours."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from glass_bench.figures import Displayed

SCRIPTS = "\n".join((Path(__file__).parent / name).read_text() for name in ("marks.js", "watch.js"))
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--autoplay-policy=no-user-gesture-required",
    "--disable-features=WebRtcHideLocalIpsWithMdns", "--disable-background-networking", "--disable-component-update",
]  # fmt: skip
TICKS_PER_S = 10_000
WRAP = 1 << 32
LOOKS = 60


@dataclass(frozen=True, slots=True)
class PageClock:
    """`performance.now()` of a page on this machine's monotonic clock, and the most that this can be wrong."""

    offset_s: float
    error_s: float

    def at_s(self, page_ms: float) -> float:
        return page_ms / 1000 + self.offset_s

    def age_s(self, ticks: int, at_s: float) -> float:
        """The age at ``at_s`` of a picture that was captured at ``ticks``, which wrap."""
        age_ticks = (round(at_s * TICKS_PER_S) - ticks) % WRAP
        return (age_ticks - WRAP if age_ticks > WRAP // 2 else age_ticks) / TICKS_PER_S


async def page_clock(page: Any) -> PageClock:
    """The page read its clock between asking and hearing the answer: the quickest of many answers bounds the error."""
    quickest = (float("inf"), 0.0)
    for _ in range(LOOKS):
        asked_s = time.monotonic()
        page_ms = await page.evaluate("performance.now()")
        heard_s = time.monotonic()
        quickest = min(quickest, (heard_s - asked_s, (asked_s + heard_s) / 2 - page_ms / 1000))
    return PageClock(quickest[1], quickest[0] / 2)


async def take_displayed(page: Any, clock: PageClock) -> list[Displayed]:
    """What was displayed since the last call, the oldest first."""
    return displayed(await page.evaluate("() => window.displayed.splice(0)"), clock)


def displayed(samples: Sequence[Sequence[Any]], clock: PageClock) -> list[Displayed]:
    """``samples``: display time in ms of the page, frame, ticks, height, told age in ms.

    Now and then a page reads the pixels when the next picture has replaced the one that it was called for. Then that
    next one carries the same marks: what the first one carried is not known.
    """
    pictures = []
    for (page_ms, frame, ticks, height, told_ms), following in zip_longest(samples, samples[1:]):
        at_s = clock.at_s(page_ms)
        is_own = ticks is not None and (following is None or following[1] != frame)
        age_s = clock.age_s(ticks, at_s) if is_own else None
        pictures.append(Displayed(at_s, age_s, height, None if told_ms is None else told_ms / 1000))
    return pictures
