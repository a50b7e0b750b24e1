"""The age that the dashboard shows of a picture beside the burnt-in one, with the real server and robot."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

from processes.mosaic import START_S, Site, listening_port, run_mosaic, running, token_once_ready

from glass_bench.figures import Displayed
from glass_bench.page import SCRIPTS, PageClock, page_clock, take_displayed

ROBOT_NAME = "Bench robot"
CONFIG = """\
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: test-pattern, label: front, params: {{ width: {width}, height: {height}, fps: 30 }} }}
"""
WATCH = """() => {
  const video = document.querySelector('video')
  // The widget's own store, from React's tree: what it computes is what it shows.
  const store = (() => {
    const key = Object.keys(video).find((name) => name.startsWith('__reactFiber$'))
    for (let fiber = video[key]; fiber; fiber = fiber.return)
      if (fiber.memoizedProps?.store?.pictureAgeMs) return fiber.memoizedProps.store
    throw new Error('the video widget has no store that knows the age of pictures')
  })()
  window.watchVideo(video, (rtp, atMs) => store.pictureAgeMs(rtp, atMs + performance.timeOrigin))
  const facts = document.querySelector('[data-testid=picture-facts]')
  const texts = (window.texts = [])
  new MutationObserver(() => texts.push([performance.now(), facts.textContent]))
    .observe(facts, { childList: true, characterData: true, subtree: true })
}"""


class Server:
    """`mosaic server run` with a robot that may be started again with another picture."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder = folder
        data_dir, ready_file = folder / "server", folder / "ready.json"
        words = ["server", "seed", "--data-dir", str(data_dir), "--robot-name", ROBOT_NAME, "--json"]
        self._seed = json.loads(run_mosaic(*words))
        words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
        process = stack.enter_context(running(folder / "server.log", *words))
        self._port = listening_port(ready_file, process, folder / "server.log")
        seed, url = self._seed, f"http://127.0.0.1:{self._port}"
        log = folder / "robot.log"
        self.site = Site(url, data_dir, log, seed["email"], seed["password"], seed["robotId"])

    def config(self, size: tuple[int, int]) -> Path:
        """The robot's file, for a picture of this size."""
        config = self._folder / "mosaic_config.yaml"
        words = {"port": self._port, "robot_id": self._seed["robotId"], "token": self._seed["robotToken"]}
        config.write_text(CONFIG.format(**words, width=size[0], height=size[1]))
        return config

    @contextmanager
    def robot(self, size: tuple[int, int]) -> Iterator[None]:
        with running(self.site.robot_log, "run", str(self.config(size)), "--json"):
            yield


@asynccontextmanager
async def signed_in(browser: Any, site: Site) -> AsyncIterator[Any]:
    """A page at the list of robots."""
    page = await browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(START_S * 1000)
    try:
        await page.goto(site.url)
        await page.get_by_label("Email").fill(site.email)
        await page.locator("input[type=password]").fill(site.password)
        await page.keyboard.press("Enter")
        await page.get_by_role("heading", name="Robots").wait_for()
        yield page
    finally:
        await page.close()


async def compared(
    browser: Any, server: Server, size: tuple[int, int], settle_s: float, seconds: float
) -> tuple[list[Displayed], list[tuple[float, float]]]:
    """What was displayed, and (monotonic s, ms) of the age that stood over the picture."""
    with server.robot(size):
        await token_once_ready(server.site)
        async with signed_in(browser, server.site) as page:
            await page.goto(f"{server.site.url}/robots/{server.site.robot_id}")
            await page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
            await page.evaluate(SCRIPTS)
            clock = await page_clock(page)
            await page.evaluate(WATCH)
            await asyncio.sleep(settle_s)
            await take_displayed(page, clock)
            await page.evaluate("() => window.texts.splice(0)")
            await asyncio.sleep(seconds)
            return await take_displayed(page, clock), await shown_ages_ms(page, clock)


async def shown_ages_ms(page: Any, clock: PageClock) -> list[tuple[float, float]]:
    """From texts such as `42 ms old · 30 fps`."""
    texts = await page.evaluate("() => window.texts.splice(0)")
    return [(clock.at_s(page_ms), float(text.split(" ms old")[0])) for page_ms, text in texts if " ms old" in text]
