"""From the operator's click to the first value and the first picture, on loopback, beside plain aiortc in the same run.

python bench/connect.py [ROUNDS]

Server, robot and browser are processes of their own. Plain aiortc (its default configuration, no ICE servers) talks to
a second process over a pipe: no server, no sign-in, no catalogue. Everything is repeated with a STUN server that never
answers, which both sides are told to use. Every path is taken once before anything is measured.
"""

from __future__ import annotations

import asyncio
import json
import math
import socket
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import AsyncExitStack, ExitStack, closing, suppress
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from connect_bench.firsts import ATTEMPT_S, Attempt, Firsts, taken
from connect_bench.plain import aiortc_attempt, answer_calls
from processes.browser import chromium
from processes.mosaic import START_S, Site, end_like_ctrl_c, listening_port, run_mosaic, running, token_once_ready
from processes.other_end import other_end
from rich.console import Console
from rich.table import Table

from mosaic_core.operator import MosaicOperator
from mosaic_core.words.signaling import RobotStatus

if TYPE_CHECKING:
    from playwright.async_api import Page

ROBOT_NAME = "Bench robot"
PEER = "plain aiortc"
STUN_ROUNDS = 3
"""Plain aiortc waits five seconds on each side for the STUN server: more rounds would tell nothing new."""
QUIET = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
CONFIG = """\
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: test-pattern, label: front, params: {{ width: 640, height: 480, fps: 30 }} }}
  - {{ type: sim-pose, label: pose, params: {{ period_s: 0.02 }} }}
"""
OBSERVER = """() => {
  const seen = (window.firsts = {})
  const mark = (name) => { seen[name] ??= performance.now() }
  const look = () => {
    for (const video of document.querySelectorAll('video:not([data-observed])')) {
      video.dataset.observed = ''
      video.requestVideoFrameCallback(() => mark('frame'))
    }
    if (document.querySelector('[data-testid=trail-text]')?.textContent) mark('data')
  }
  document.addEventListener('click', (event) => { seen.click ??= event.timeStamp }, { capture: true })
  new MutationObserver(look).observe(document, { childList: true, characterData: true, subtree: true })
}"""
"""`click` is when the input event was made, not when the page got round to it."""


# -- processes ---------------------------------------------------------------------------------------------------------


def start_site(folder: Path, stack: ExitStack) -> Site:
    data_dir, ready_file = folder / "server", folder / "ready.json"
    words = ["server", "seed", "--data-dir", str(data_dir), "--robot-name", ROBOT_NAME, "--json"]
    seeded = json.loads(run_mosaic(*words))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    server = stack.enter_context(running(folder / "server.log", *words))
    port = listening_port(ready_file, server, folder / "server.log")
    config = folder / "mosaic_config.yaml"
    config.write_text(CONFIG.format(port=port, robot_id=seeded["robotId"], token=seeded["robotToken"]))
    robot_log = folder / "robot.log"
    stack.enter_context(running(robot_log, "run", str(config), "--json"))
    url = f"http://127.0.0.1:{port}"
    return Site(url, data_dir, robot_log, seeded["email"], seeded["password"], seeded["robotId"])


class SilentStunServer:
    """Takes every request and answers none, which is how a blocked STUN server looks."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self.url = f"stun:127.0.0.1:{self._socket.getsockname()[1]}"

    def close(self) -> None:
        self._socket.close()

    def taken_requests(self) -> int:
        """How many came since the last look."""
        count = 0
        with suppress(BlockingIOError):
            while self._socket.recv(2048):
                count += 1
        return count

    def required(self, name: str, attempt: Attempt) -> Attempt:
        """The same attempt; it is an error if nobody asked this server meanwhile: the figure would mean nothing."""

        async def checked() -> Firsts:
            self.taken_requests()
            firsts = await attempt()
            if not self.taken_requests():
                raise SystemExit(f"{name}: nobody asked the STUN server")
            return firsts

        return checked


# -- MOSAIC ------------------------------------------------------------------------------------------------------------


async def python_attempt(site: Site, access_token: str) -> Firsts:
    """A program that is signed in and sees the robot online connects to it."""
    async with MosaicOperator(site.url, access_token) as operator:
        await operator.wait_status(site.robot_id, RobotStatus.READY_TO_CONNECT, START_S)
        clicked_at_s = time.perf_counter()
        connection = await operator.connect(site.robot_id)
        value = connection.receivable("pose").next_message(ATTEMPT_S)
        frame = connection.media("front").next_frame(ATTEMPT_S)
        data_s, frame_s = await asyncio.gather(taken(value, clicked_at_s), taken(frame, clicked_at_s))
        return Firsts(data_s, frame_s)


async def browser_attempt(site: Site, page: Page) -> Firsts:
    """A person on the list of robots, signed in, clicks on the one that is online after having looked at it for a
    moment: what the page fetches beforehand has come by then."""
    await page.goto(site.url)
    robot = page.get_by_role("link").filter(has_text=ROBOT_NAME)
    await robot.get_by_text("Online", exact=True).wait_for()
    await page.wait_for_load_state("networkidle")
    await page.evaluate(OBSERVER)
    await robot.click()
    await page.wait_for_function("() => window.firsts.frame && window.firsts.data", polling=100)
    seen = await page.evaluate("() => window.firsts")
    await page.goto("about:blank")
    return Firsts((seen["data"] - seen["click"]) / 1000, (seen["frame"] - seen["click"]) / 1000)


class NoBrowser(Exception):
    """Says why there are no rows of Chromium."""


def require_browser() -> None:
    import mosaic_server

    if chromium() is None:
        raise NoBrowser("no Chromium; apt install chromium, or name one in MOSAIC_CHROMIUM")
    if find_spec("playwright") is None:
        raise NoBrowser("no playwright; pip install playwright")
    if not (Path(mosaic_server.__file__).parent / "dashboard" / "index.html").exists():
        raise NoBrowser("the dashboard is not built; npm run build in dashboard/")


async def open_dashboard(site: Site, stack: AsyncExitStack) -> Page:
    """The list of robots in a new browser, signed in; raises :class:`NoBrowser`."""
    require_browser()
    from playwright.async_api import Error, async_playwright

    playwright = await stack.enter_async_context(async_playwright())
    try:
        browser = await playwright.chromium.launch(executable_path=chromium(), args=QUIET)
    except Error as error:
        raise NoBrowser(f"{chromium()} does not start; {error.message.splitlines()[0]}") from error
    stack.push_async_callback(browser.close)
    page = await browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(ATTEMPT_S * 1000)
    await page.goto(site.url)
    await page.get_by_label("Email").fill(site.email)
    await page.locator("input[type=password]").fill(site.password)
    await page.keyboard.press("Enter")
    await page.get_by_role("heading", name="Robots").wait_for()
    return page


# -- rounds and tables -------------------------------------------------------------------------------------------------


async def alternate(attempts: dict[str, Attempt], rounds: int) -> dict[str, list[Firsts]]:
    found: dict[str, list[Firsts]] = {name: [] for name in attempts}
    for number in range(rounds):
        for name, attempt in attempts.items():
            try:
                async with asyncio.timeout(ATTEMPT_S):
                    found[name].append(await attempt())
            except TimeoutError:
                raise SystemExit(f"{name}: nothing after {ATTEMPT_S:.0f} s in round {number + 1}") from None
    return found


def p95(values: Sequence[float]) -> float:
    """The nearest rank: with fewer than twenty values it is the largest."""
    return sorted(values)[math.ceil(0.95 * len(values)) - 1]


def new_table(title: str, found: dict[str, list[Firsts]]) -> Table:
    table = Table(title=title)
    for column in ("path", "first", "median ms", "min", "max", "p95", "x aiortc"):
        table.add_column(column, justify="left" if column in ("path", "first") else "right")
    for name, attempts in found.items():
        for what in ("data", "frame"):
            values, peer = ([getattr(one, f"{what}_s") for one in all_] for all_ in (attempts, found[PEER]))
            figures = (statistics.median(values), min(values), max(values), p95(values))
            ratio = statistics.median(values) / statistics.median(peer)
            table.add_row(name, what, *(f"{1000 * value:.0f}" for value in figures), f"{ratio:.2f}")
        table.add_section()
    return table


async def measure(site: Site, pipe: Connection, rounds: int, console: Console) -> None:
    token = await token_once_ready(site)
    ours: dict[str, Attempt] = {"MOSAIC, Python": lambda: python_attempt(site, token)}
    async with AsyncExitStack() as stack:
        try:
            page = await open_dashboard(site, stack)
            ours["MOSAIC, Chromium"] = lambda: browser_attempt(site, page)
        except NoBrowser as error:
            console.print(f"The rows of Chromium are missing: {error}.")
        attempts: dict[str, Attempt] = {PEER: lambda: aiortc_attempt(pipe, []), **ours}
        cold = await alternate(attempts, 1)
        found = await alternate(attempts, rounds)
        console.print(new_table(f"Click to first data and first frame; alternating rounds: {rounds}", found))
        console.print(f"The very first attempt (data, frame), not in the table: {in_words(cold)}\n")
        stun = stack.enter_context(closing(SilentStunServer()))
        run_mosaic("server", "ice", "add", stun.url, "--data-dir", str(site.data_dir))
        attempts[PEER] = lambda: aiortc_attempt(pipe, [stun.url])
        attempts = {name: stun.required(name, attempt) for name, attempt in attempts.items()}
        found = await alternate(attempts, min(rounds, STUN_ROUNDS))
        title = f"With an unreachable STUN server configured; alternating rounds: {min(rounds, STUN_ROUNDS)}"
        console.print(new_table(title, found))


def in_words(cold: dict[str, list[Firsts]]) -> str:
    each = (f"{name} {1000 * one.data_s:.0f}, {1000 * one.frame_s:.0f} ms" for name, (one,) in cold.items())
    return "; ".join(each) + "."


def main() -> None:
    end_like_ctrl_c()
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    try:
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            pipe = stack.enter_context(other_end(answer_calls))
            site = start_site(Path(folder), stack)
            asyncio.run(measure(site, pipe, rounds, Console()))
    except KeyboardInterrupt:
        raise SystemExit("interrupted") from None


if __name__ == "__main__":
    main()
