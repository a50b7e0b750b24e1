"""Real processes for tests that need them: a server, robots, and where to find Chromium."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest
from support.robot_process import RobotProcess, write_config
from support.server_process import Seed, ServerProcess
from support.waiting import wait_for

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright
    from support.people import Tabs

QUIET = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--in-process-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(name="wait_for", scope="session")
def wait_for_fixture() -> Callable[..., float]:
    return wait_for


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    """One for all tests, each module of which has an account and a robot of its own; who stops it starts it again."""
    running = ServerProcess(tmp_path_factory.mktemp("server"))
    try:
        running.seed()  # so that there is a database to look at
        running.start()
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="module")
def seed(server: ServerProcess) -> Seed:
    """The account and the robot of this module."""
    return server.seed()


@pytest.fixture(scope="module")
def start_robot(server: ServerProcess, seed: Seed, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """`start_robot(connectors_yaml)` → a running robot that is ready for operators."""
    robots: list[RobotProcess] = []

    def start(connectors: str, *, wait: bool = True) -> RobotProcess:
        ws_url = f"ws://127.0.0.1:{server.port}"
        robot = RobotProcess(write_config(tmp_path_factory.mktemp("robot"), ws_url, seed, connectors))
        robots.append(robot)
        robot.start()
        if wait:
            robot.wait_until_ready()
        return robot

    yield start
    for robot in robots:
        robot.stop()


@pytest.fixture(scope="session")
def whole_chromium() -> str:
    """Path of a Chromium or Chrome as people have it; the test is skipped (in CI: fails) where there is none."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    found = os.environ.get("MOSAIC_CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip("no Chromium: apt install chromium, or name one in MOSAIC_CHROMIUM")
    return found


@pytest.fixture(scope="session")
def chromium(request: pytest.FixtureRequest) -> str:
    """Path of one without the windows around the pages, where there is one: it takes half the processor's time."""
    bare = shutil.which("chromium-headless-shell")
    return bare if bare and "MOSAIC_CHROMIUM" not in os.environ else request.getfixturevalue("whole_chromium")


@pytest.fixture(scope="session")
def quiet_words() -> list[str]:
    """What a Chromium of ours is started with: no window, no graphics card, no talk with its maker."""
    return QUIET


@pytest.fixture(scope="session")
def playwright(chromium: str) -> Iterator[Playwright]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright, chromium: str) -> Iterator[Browser]:
    running = playwright.chromium.launch(executable_path=chromium, args=QUIET)
    yield running
    running.close()


@pytest.fixture(scope="session")
def tabs(browser: Browser, server: ServerProcess) -> Tabs:
    """`with tabs.lent() as page`: somebody's tab, who is not signed in yet."""
    from support.people import Tabs

    return Tabs(browser, server)
