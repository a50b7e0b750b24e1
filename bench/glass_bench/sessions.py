"""One sender and one page that watches it, from the offer to what was displayed."""

from __future__ import annotations

import asyncio
import base64
import re
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import cv2

from glass_bench.figures import Displayed
from glass_bench.film import FPS, painter
from glass_bench.page import SCRIPTS, PageClock, page_clock, take_displayed
from glass_bench.senders import SenderProcess, Shot

FIRST_PICTURE_S = 20.0
START_KBPS = 2500


class Answering(Protocol):
    async def answer(self, offer_sdp: str) -> str: ...

    async def close(self) -> None: ...


class ChromiumSender:
    """A page of another Chromium that sends a canvas."""

    def __init__(self, browser: Any, size: tuple[int, int]) -> None:
        self._browser, self._size = browser, size
        self._page: Any = None

    async def answer(self, offer_sdp: str) -> str:
        page = self._page = await self._browser.new_page()
        await page.evaluate(SCRIPTS)
        clock = await page_clock(page)
        width, height = self._size
        _, png = cv2.imencode(".png", painter("pattern", self._size)(0, 0.0))
        background = "data:image/png;base64," + base64.b64encode(png.tobytes()).decode()
        words = {
            "sdp": offer_sdp, "width": width, "height": height, "fps": FPS, "background": background,
            "offsetMs": clock.offset_s * 1000,
        }  # fmt: skip
        return str(await page.evaluate("(words) => window.answerWithCanvas(words)", words))

    async def close(self) -> None:
        if self._page is not None:
            await self._page.close()


@dataclass
class Session:
    """A page that shows pictures of one sender."""

    page: Any
    clock: PageClock
    sender: Answering

    async def displayed(self, seconds: float) -> list[Displayed]:
        """What is displayed from now on."""
        await take_displayed(self.page, self.clock)
        await asyncio.sleep(seconds)
        return await take_displayed(self.page, self.clock)

    async def bytes_log(self) -> list[tuple[float, int]]:
        """(monotonic s, bytes so far) since the last call."""
        log = await self.page.evaluate("() => window.bytesLog.splice(0)")
        return [(self.clock.at_s(page_ms), size) for page_ms, size in log]


def from_the_full_rate(offer_sdp: str) -> str:
    """libwebrtc begins with 300 kbit/s and small pictures unless the other side says so; nobody else heeds it."""
    return re.sub(r"(a=rtpmap:(\d+) VP8/90000\r\n)", rf"\1a=fmtp:\2 x-google-start-bitrate={START_KBPS}\r\n", offer_sdp)


@asynccontextmanager
async def session(browser: Any, other_browser: Any, shot: Shot) -> AsyncIterator[Session]:
    """Connected and displaying. Raises :class:`TimeoutError` if no picture comes."""
    page = await browser.new_page()
    is_chromium = shot.way.sender == "Chromium"
    sender: Answering = ChromiumSender(other_browser, shot.size) if is_chromium else SenderProcess(shot)
    try:
        await page.evaluate(SCRIPTS)
        clock = await page_clock(page)
        answer = await sender.answer(from_the_full_rate(await page.evaluate("() => window.offerToWatch()")))
        await page.evaluate("(sdp) => window.peer.setRemoteDescription({ type: 'answer', sdp })", answer)
        await page.evaluate("() => window.logBytes()")
        ends_at_s = time.monotonic() + FIRST_PICTURE_S
        while not await page.evaluate("() => (window.displayed ?? []).length"):
            if time.monotonic() > ends_at_s:
                raise TimeoutError(f"{shot.way.name}: no picture within {FIRST_PICTURE_S:.0f} s")
            await asyncio.sleep(0.05)
        yield Session(page, clock, sender)
    finally:
        await sender.close()
        await page.close()
