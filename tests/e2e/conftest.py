"""A simulated robot in a real process, a real Chromium, and an observer that knows where the robot really is."""

from __future__ import annotations

import asyncio
import json
import math
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, Playwright, expect

from mosaic_core.operator import MessageInfo, MosaicOperator

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { fps: 15 } }
  - { type: sim-laser-scan, label: scan }
  - { type: sim-pose, label: pose, params: { period_s: 0.02 } }
  - { type: sim-battery, label: battery }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
  - { type: connection-check, label: link }
"""
REST_M = 0.002
"""Less way than this between two looks counts as standing."""


@dataclass
class PoseObserver:
    """An operator on a thread of its own that only watches the pose; it keeps where the robot was and when."""

    url: str
    email: str
    password: str
    robot_id: str
    poses: list[tuple[float, float, float, float]] = field(default_factory=list)
    """(monotonic s when the robot said so, x m, y m, yaw rad): arrivals bunch on a busy machine."""
    _loop: asyncio.AbstractEventLoop = field(default_factory=asyncio.new_event_loop)
    _done: asyncio.Event = field(default_factory=asyncio.Event)
    _thread: threading.Thread | None = None
    _failure: BaseException | None = None

    def start(self) -> None:
        self._thread = threading.Thread(target=self._run, name="pose-observer", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        if self._loop.is_running():
            self._loop.call_soon_threadsafe(self._done.set)
        if self._thread is not None:
            self._thread.join(timeout=10)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._watch())
        except BaseException as error:  # noqa: BLE001 (shown by the test that waits)
            self._failure = error
        finally:
            self._loop.close()

    async def _watch(self) -> None:
        async with await MosaicOperator.login(self.url, self.email, self.password) as operator:
            connection = await operator.connect(self.robot_id)
            connection.receivable("pose").subscribe(self._take)
            await self._done.wait()

    def _take(self, data: bytes, info: MessageInfo) -> None:
        pose = json.loads(data)
        z, w = pose["orientation"]["z"], pose["orientation"]["w"]
        self.poses.append((info.stamp_us / 1e6, pose["position"]["x"], pose["position"]["y"], 2 * math.atan2(z, w)))

    @property
    def is_watching(self) -> bool:
        assert self._failure is None, self._failure
        return bool(self.poses)

    @property
    def now(self) -> tuple[float, float, float, float]:
        return self.poses[-1]

    def way_m(self, since_s: float) -> float:
        """Length of the path since then."""
        points = [pose for pose in self.poses if pose[0] >= since_s]
        return sum(math.dist(a[1:3], b[1:3]) for a, b in pairwise(points))

    def rests(self) -> bool:
        """The last 0.2 s brought no way."""
        newest_s = self.now[0]
        is_fresh = time.monotonic() - newest_s < 0.15
        return is_fresh and self.poses[0][0] < newest_s - 0.2 and self.way_m(newest_s - 0.2) < REST_M

    def stays(self, wait_for: Callable[..., float]) -> bool:
        """For 0.8 s: enough for a command to act if it did."""
        start_s = time.monotonic()
        wait_for(lambda: self.now[0] > start_s + 0.8, "time passes")
        return self.way_m(start_s) < 2 * REST_M

    def last_moved_s(self, since_s: float) -> float:
        """When the robot last moved after `since_s`."""
        points = [pose for pose in self.poses if pose[0] >= since_s]
        moved = [b[0] for a, b in pairwise(points) if math.dist(a[1:3], b[1:3]) > 0.0005]
        return moved[-1] if moved else since_s


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS)


@pytest.fixture(scope="module")
def observer(server: Any, seed: Any, robot: Any, wait_for: Callable[..., float]) -> Iterator[PoseObserver]:
    watching = PoseObserver(server.url, seed.email, seed.password, seed.robot_id)
    watching.start()
    wait_for(lambda: watching.is_watching, "the observer sees the pose")
    yield watching
    watching.stop()


@dataclass
class Driver:
    """What a person does on the pages."""

    page: Page
    url: str
    seed: Any

    def sign_in(self) -> None:
        self.page.goto(self.url)
        self.page.get_by_label("Email").fill(self.seed.email)
        self.page.locator("input[type=password]").fill(self.seed.password)
        self.page.keyboard.press("Enter")
        self.page.get_by_role("heading", name="Robots").wait_for()

    @property
    def lease(self) -> Locator:
        return self.page.get_by_test_id("lease-motion")

    def take_control(self) -> None:
        expect(self.lease).to_have_attribute("data-state", "free", timeout=10_000)
        self.lease.click()
        self.expect_control()

    def expect_control(self) -> None:
        expect(self.lease).to_have_attribute("data-state", "mine", timeout=10_000)

    def expect_no_control(self) -> None:
        expect(self.lease).not_to_have_attribute("data-state", "mine", timeout=10_000)

    def hold_keys(self) -> None:
        """Turning in place at the same time keeps the robot off the walls."""
        self.page.keyboard.down("a")
        self.page.keyboard.down("w")

    def release_keys(self) -> None:
        self.page.keyboard.up("w")
        self.page.keyboard.up("a")

    def drive_off(self, observer: PoseObserver, wait_for: Callable[..., float]) -> None:
        """Hold the keys until the robot moves."""
        start_s = time.monotonic()
        self.hold_keys()
        wait_for(lambda: observer.way_m(start_s) > 0.05, "the robot moves while the key is held", 10)

    def open_robot(self) -> None:
        self.page.goto(f"{self.url}/robots/{self.seed.robot_id}")
        self.page.get_by_text("Connected", exact=True).wait_for()
        self.page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
        self.page.get_by_role("application", name="Drive pad").wait_for()

    def picture(self) -> list[int]:
        """The picture, 64 x 48 gray values, read from the video element itself."""
        gray: list[int] = self.page.evaluate(
            """() => {
              const video = document.querySelector('video')
              const canvas = document.createElement('canvas')
              canvas.width = 64; canvas.height = 48
              const context = canvas.getContext('2d')
              context.drawImage(video, 0, 0, 64, 48)
              const rgba = context.getImageData(0, 0, 64, 48).data
              return Array.from({length: 64 * 48}, (_, i) => Math.round((rgba[4*i] + rgba[4*i+1] + rgba[4*i+2]) / 3))
            }"""
        )
        return gray


@pytest.fixture(scope="module")
def sign_in(server: Any, seed: Any) -> Callable[[Page], None]:
    """`sign_in(page)`: the list of robots, for the person of `seed`."""
    return lambda page: Driver(page, server.url, seed).sign_in()


@pytest.fixture(scope="module")
def driver_of(server: Any, seed: Any) -> Callable[[Page], Driver]:
    """`driver_of(page)`: a signed-in person on the robot's page."""

    def signed_in(page: Page) -> Driver:
        person = Driver(page, server.url, seed)
        person.sign_in()
        person.open_robot()
        return person

    return signed_in


@contextmanager
def new_page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    errors: list[str] = []
    page = context.new_page()
    page.set_default_timeout(20_000)
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    context.close()
    assert not errors, errors


@pytest.fixture
def driver(browser: Browser, driver_of: Any, observer: PoseObserver, wait_for: Any) -> Iterator[Driver]:
    """A signed-in person on the robot's page; the robot stands still."""
    wait_for(observer.rests, "the robot rests before the test")
    with new_page(browser) as page:
        yield driver_of(page)


@pytest.fixture
def ann(driver: Driver) -> Driver:
    """Who takes control first."""
    driver.take_control()
    return driver


@pytest.fixture
def bob(ann: Driver, browser: Browser, driver_of: Any) -> Iterator[Driver]:
    """Who comes second."""
    with new_page(browser) as page:
        yield driver_of(page)


@dataclass
class OwnBrowser:
    """A browser process of its own, so that it can be killed or stopped by its pid."""

    process: subprocess.Popen[bytes]
    browser: Browser


@pytest.fixture
def own_browser(
    playwright: Playwright, chromium: str, quiet_words: list[str], tmp_path: Path, wait_for: Any
) -> Iterator[OwnBrowser]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = [chromium, *quiet_words, f"--user-data-dir={tmp_path}", f"--remote-debugging-port={port}", "about:blank"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)

    def listens() -> bool:
        with socket.socket() as trial:
            return trial.connect_ex(("127.0.0.1", port)) == 0

    wait_for(listens, "the browser takes connections", alive=process)
    yield OwnBrowser(process, playwright.chromium.connect_over_cdp(f"http://127.0.0.1:{port}"))
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # its helper processes too, also while they are stopped
    process.wait(timeout=10)
