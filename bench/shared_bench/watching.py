"""A page of Chromium in the operator's network that watches several cameras, from the offer to what was displayed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glass_bench.figures import Displayed
from glass_bench.page import FLAGS, PageClock, displayed, page_clock
from glass_bench.sessions import from_the_full_rate
from laboratory.networks import Namespace

from shared_bench.link import SharedLink
from shared_bench.senders import CUT, Cameras, CamerasProcess

SCRIPTS = "\n".join(
    (Path(__file__).parents[1] / name).read_text() for name in ("glass_bench/marks.js", "shared_bench/shared.js")
)
FIRST_PICTURE_S = 20.0


@asynccontextmanager
async def chromium_in(playwright: Any, namespace: Namespace, program: str, folder: Path) -> AsyncIterator[Any]:
    """A browser whose sockets are in there; it is spoken to by a pipe."""
    script = folder / f"chromium-{namespace.name}"
    script.write_text(f'#!/bin/sh\nexec {" ".join(namespace.prefix)} "{program}" "$@"\n')
    script.chmod(0o755)
    browser = await playwright.chromium.launch(executable_path=str(script), args=FLAGS)
    try:
        yield browser
    finally:
        await browser.close()


class ChromiumCameras:
    """A page in the robot's network that sends canvases."""

    def __init__(self, browser: Any, cameras: Cameras) -> None:
        self._browser, self._cameras = browser, cameras
        self._page: Any = None

    async def answer(self, offer_sdp: str) -> str:
        page = self._page = await self._browser.new_page()
        await page.evaluate(SCRIPTS)
        clock = await page_clock(page)
        width, height = self._cameras.size
        words = {
            "sdp": offer_sdp, "count": self._cameras.count, "width": width, "height": height,
            "fps": self._cameras.fps, "offsetMs": clock.offset_s * 1000,
        }  # fmt: skip
        return str(await page.evaluate("(words) => window.answerWithNoise(words)", words))

    async def answer_bulk(self, offer_sdp: str) -> str:
        return str(await self._page.evaluate("(sdp) => window.answerWithBulk(sdp)", offer_sdp))

    def order(self, what: str) -> None:
        if what == CUT:
            self._cutting = asyncio.ensure_future(self._page.evaluate("() => window.cut()"))

    async def close(self) -> None:
        await self._page.close()


@dataclass
class Watched:
    """Cameras of one robot on one page."""

    page: Any
    clock: PageClock
    sender: Any

    async def transfer(self) -> None:
        """Bulk data comes as fast as the sender may send it, from now on."""
        answer = await self.sender.answer_bulk(await self.page.evaluate("() => window.offerBulk()"))
        await self.page.evaluate("(sdp) => window.bulk.setRemoteDescription({ type: 'answer', sdp })", answer)

    async def transferred_bytes(self) -> int:
        return int(await self.page.evaluate("() => window.bulkBytes ?? window.sensorBytes"))

    async def take(self) -> list[list[Displayed]]:
        """What each camera has displayed since the last call."""
        lists = await self.page.evaluate("() => window.displayed.map((one) => one.splice(0))")
        return [displayed(samples, self.clock) for samples in lists]


@asynccontextmanager
async def watched(link: SharedLink, operator: Any, robot: Any, cameras: Cameras) -> AsyncIterator[Watched]:
    """``operator`` and ``robot``: the browsers of both sides. Every camera that is asked for has shown a picture."""
    page = await operator.new_page()
    is_chromium = cameras.sender == "Chromium"
    sender = ChromiumCameras(robot, cameras) if is_chromium else CamerasProcess(cameras, link.robot)
    try:
        await page.evaluate(SCRIPTS)
        clock = await page_clock(page)
        offer = await page.evaluate(
            "([count, has]) => window.offerToWatch(count, has)", [cameras.count, cameras.sensor_bps > 0]
        )
        answer = await sender.answer(from_the_full_rate(offer))
        await page.evaluate("(sdp) => window.peer.setRemoteDescription({ type: 'answer', sdp })", answer)
        wanted, ends_at_s = cameras.count - cameras.late, time.monotonic() + FIRST_PICTURE_S
        while await page.evaluate("() => window.displayed.filter((one) => one.length > 0).length") < wanted:
            if time.monotonic() > ends_at_s:
                raise TimeoutError(f"{cameras.sender}: not every camera shows a picture")
            await asyncio.sleep(0.05)
        yield Watched(page, clock, sender)
    finally:
        await sender.close()
        await page.close()
