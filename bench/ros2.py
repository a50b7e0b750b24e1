"""What it costs to show a node of ROS 2 to an operator in Chromium: 640×480 pictures at 30/s and clouds of 100 000
points at 10/s over DDS, by MOSAIC, by a bridge in the manner of rosbridge (JSON with base64 over a WebSocket, written
here) and by Foxglove's server, where `pip install foxglove-sdk` was called.

python bench/ros2.py [SECONDS] [ROUNDS]

Node, bridge or robot, server and browser are processes of their own on loopback, in turns. Ages run from the node's
clock: to the picture on the screen (MOSAIC) or in a canvas (the bridges), and to the cloud as an array of numbers.
MB/s: of messages; MOSAIC's pictures are no messages and take what `max_bitrate_bps` allows. CPU: of the bridge or
robot, and of all of the browser.
"""

from __future__ import annotations

import asyncio
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil
from glass_bench.page import FLAGS, PageClock, page_clock, take_displayed
from playwright.async_api import async_playwright
from processes.browser import chromium
from processes.mosaic import Site, listening_port, run_mosaic, running, token_once_ready
from processes.other_end import other_end
from ros2_bench.foxglove_bridge import foxglove_bridge
from ros2_bench.json_bridge import bridge
from ros2_bench.node import publish
from ros2_bench.pages import SOCKETS, mosaic_script

SETTLE_S = 3.0
FIRST_S = 30.0
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: ros2-image, label: front, params: {{ topic: /image, domain: {domain}, interface: lo }} }}
  - {{ type: ros2-point-cloud, label: cloud, params: {{ topic: /points, domain: {domain}, interface: lo }} }}
"""


@dataclass
class Seen:
    """What arrived while it was measured."""

    name: str
    ages_ms: dict[str, list[float]] = field(default_factory=lambda: {"image": [], "cloud": []})
    sent: dict[str, int] = field(default_factory=dict)
    mbyteps: float = 0.0
    sender_cpu: float = 0.0
    browser_cpu: float = 0.0

    def row(self) -> str:
        cells = [self.name]
        for kind in ("image", "cloud"):
            ages = sorted(self.ages_ms[kind])
            lost = 100 * (1 - len(ages) / max(1, self.sent[kind]))
            middle, late = (statistics.median(ages), ages[int(len(ages) * 0.95)]) if ages else (float("nan"),) * 2
            cells += [f"{middle:.0f} / {late:.0f}", f"{max(0.0, lost):.0f} %"]
        cells += [f"{self.mbyteps:.1f}", f"{self.sender_cpu:.0f} %", f"{self.browser_cpu:.0f} %"]
        return f"| {' | '.join(cells)} |"


@dataclass
class Stand:
    """What every way is measured on."""

    browser: Any
    node: Any
    domain: int
    seconds: float
    mosaic_page: str


def used_s(pids: list[int]) -> float:
    """Processor time of these processes so far."""
    times = [psutil.Process(pid).cpu_times() for pid in pids if psutil.pid_exists(pid)]
    return float(sum(one.user + one.system for one in times))


def browser_pids() -> list[int]:
    """Every process of the browser that this one has started."""
    return [one.pid for one in psutil.Process().children(recursive=True) if "chrom" in one.name().lower()]


async def measured(stand: Stand, seen: Seen, page: Any, clock: PageClock, sender: int) -> None:
    """Once both come: what comes in so many seconds, and what it costs."""
    await page.wait_for_function("() => window.seen?.cloud.length > 0", timeout=FIRST_S * 1000)
    await asyncio.sleep(SETTLE_S)
    is_video = await page.evaluate("() => !window.seen.image")
    take = "() => { const one = window.seen; window.took = structuredClone(one); one.bytes = 0; one.cloud.length = 0;"
    take += " if (one.image) one.image.length = 0; return window.took }"
    await page.evaluate(take)
    if is_video:
        await take_displayed(page, clock)
    sent, began_s, pids = counted(stand.node), time.monotonic(), browser_pids()
    sender_s, browser_s = used_s([sender]), used_s(pids)
    await asyncio.sleep(stand.seconds)
    took, took_s = await page.evaluate(take), time.monotonic() - began_s
    after = counted(stand.node)
    seen.sender_cpu = 100 * (used_s([sender]) - sender_s) / took_s
    seen.browser_cpu = 100 * (used_s(pids) - browser_s) / took_s
    seen.sent = {"image": after[0] - sent[0], "cloud": after[1] - sent[1]}
    seen.mbyteps = took["bytes"] / took_s / 1e6
    for kind in ("cloud",) if is_video else ("image", "cloud"):
        seen.ages_ms[kind] = [1000 * (clock.at_s(at_ms) - stamp_s) for at_ms, stamp_s in took[kind]]
    if is_video:
        shown = await take_displayed(page, clock)
        seen.ages_ms["image"] = [1000 * one.age_s for one in shown if one.age_s is not None]


def counted(node: Any) -> tuple[int, int]:
    """How many pictures and clouds the node has sent."""
    node.send("count")
    found: tuple[int, int] = node.recv()
    return found


async def by_mosaic(stand: Stand) -> Seen:
    seen = Seen("MOSAIC")
    with ExitStack() as stack, tempfile.TemporaryDirectory() as name:
        site, robot = _site(Path(name), stack, stand.domain)
        await token_once_ready(site)
        page = await stand.browser.new_page(bypass_csp=True)
        await page.goto(f"{site.url}/healthz")  # an answer of the server's own, so that the page may ask it
        await page.set_content("<!doctype html><body></body>")
        await page.add_script_tag(content=stand.mosaic_page)
        clock = await page_clock(page)
        await page.evaluate("(words) => window.watchMosaic(...words)", [site.email, site.password, site.robot_id])
        await measured(stand, seen, page, clock, robot)
        await page.close()
    return seen


def _site(folder: Path, stack: ExitStack, domain: int) -> tuple[Site, int]:
    """A server and a robot; the robot's process id."""
    data_dir, ready_file, log = folder / "server", folder / "ready.json", folder / "server.log"
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    port = listening_port(ready_file, stack.enter_context(running(log, *words)), log)
    config, robot_log = folder / "mosaic_config.yaml", folder / "robot.log"
    told = {"robot_id": seeded["robotId"], "token": seeded["robotToken"]}
    config.write_text(CONFIG.format(port=port, domain=domain, **told))
    robot = stack.enter_context(running(robot_log, "run", str(config), "--json"))
    url = f"http://127.0.0.1:{port}"
    return Site(url, data_dir, robot_log, seeded["email"], seeded["password"], seeded["robotId"]), robot.pid


async def by_socket(serve: Callable[..., None], function: str, name: str, stand: Stand) -> Seen:
    seen = Seen(name)
    with other_end(partial(serve, domain=stand.domain)) as pipe:
        port, pid = await asyncio.to_thread(pipe.recv)
        page = await stand.browser.new_page()
        await page.add_script_tag(content=SOCKETS)
        clock = await page_clock(page)
        await page.evaluate(f"(url) => window.{function}(url)", f"ws://127.0.0.1:{port}")
        await measured(stand, seen, page, clock, pid)
        await page.close()
    return seen


def ways() -> list[Callable[[Stand], Awaitable[Seen]]]:
    """Those that can be measured here."""
    found: list[Callable[[Stand], Awaitable[Seen]]] = [
        by_mosaic,
        partial(by_socket, bridge, "watchJson", "JSON and base64 over a WebSocket"),
    ]
    if find_spec("foxglove") is not None:
        found.append(partial(by_socket, foxglove_bridge, "watchFoxglove", "Foxglove's server, CDR over a WebSocket"))
    else:
        print("Foxglove's server is left out: pip install foxglove-sdk")
    return found


async def compare(seconds: float, rounds: int) -> None:
    domain = 1 + os.getpid() % 200
    with tempfile.TemporaryDirectory() as folder, other_end(partial(publish, domain=domain)) as node:
        script = mosaic_script(Path(folder) / "page")
        async with async_playwright() as running_playwright:
            browser = await running_playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
            stand = Stand(browser, node, domain, seconds, script)
            for _ in range(rounds):
                for way in ways():
                    print((await way(stand)).row(), flush=True)
            await browser.close()


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    print(f"load before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    ages = "picture age ms, median / p95 | lost | cloud age ms, median / p95 | lost"
    print(f"| way | {ages} | MB/s | sender CPU | browser CPU |")
    print("|---|---|---|---|---|---|---|---|")
    asyncio.run(compare(seconds, rounds))
    print(f"load after: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
