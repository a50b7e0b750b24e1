"""People in Chromium: what they do on the dashboard's pages."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
from playwright.sync_api import Browser, Locator, Page, expect

from support.server_process import Seed, ServerProcess
from support.waiting import PATIENCE_S, wait_for

SIZE = {"width": 1280, "height": 900}
SIGN_IN = "(token) => sessionStorage.setItem('mosaic.accessToken', token)"
"""What the dashboard does when it was given a password."""
expect.set_options(timeout=1000 * PATIENCE_S)


def access_token(url: str, email: str, password: str) -> str:
    login = {"username": email, "password": password}
    answer = httpx.post(f"{url}/api/v1/account/login/access-token", json=login).raise_for_status()
    token: str = answer.json()["resultData"]["accessToken"]
    return token


def wait_connected(page: Page) -> None:
    """Until the robot's page says so. Playwright looks twice a second for what takes a while; the page itself, in every
    frame."""
    page.wait_for_function(
        "() => document.querySelector('[data-testid=connection] [role=status]')?.textContent === 'Connected'"
    )


def photographed(page: Page, name: str) -> None:
    """Keep what the page shows now for somebody to look at, where `MOSAIC_E2E_PICTURES` names a folder."""
    if folder := os.environ.get("MOSAIC_E2E_PICTURES"):
        page.screenshot(path=Path(folder) / f"{name}.png")


@dataclass
class Tab:
    """A page that nobody has signed in on, and what went wrong in its scripts."""

    page: Page
    errors: list[str] = field(default_factory=list)


class Tabs:
    """Tabs of one browser at pages of one server, each of another person. They are used again: a process of Chromium
    that has had the dashboard before shows it for a third of the work."""

    def __init__(self, browser: Browser, server: ServerProcess) -> None:
        self._browser = browser
        self._server = server
        self._free: list[Tab] = []

    @contextmanager
    def lent(self) -> Iterator[Page]:
        """A tab that knows nothing of who had it before. It may be closed."""
        tab = self._free.pop() if self._free else self._new()
        try:
            yield tab.page
        finally:  # who failed holds no key and no lease any more either
            self._take_back(tab)
        errors, tab.errors[:] = list(tab.errors), []
        assert not errors, errors

    def _take_back(self, tab: Tab) -> None:
        if tab.page.is_closed():
            tab.page.context.close()
            return
        self._forget(tab.page)
        self._free.append(tab)

    def _new(self) -> Tab:
        context = self._browser.new_context(viewport=SIZE, reduced_motion="reduce")  # type: ignore[arg-type]
        tab = Tab(context.new_page())
        tab.page.set_default_timeout(1000 * PATIENCE_S)
        tab.page.on("pageerror", lambda error: tab.errors.append(str(error)))
        return tab

    def _forget(self, page: Page) -> None:
        """Leave the dashboard, let go of what was held, and forget who was signed in and what they chose."""
        page.goto(self._server.plain_url)
        page.mouse.up()
        for key in ("w", "a"):
            page.keyboard.up(key)
        page.evaluate("() => { sessionStorage.clear(); localStorage.clear() }")
        page.context.clear_cookies()
        page.unroute_all()


@dataclass
class Driver:
    """Does what a person does on the pages of the robot of `seed`."""

    page: Page
    url: str
    seed: Seed

    def sign_in(self) -> None:
        """By hand; `sign_in` is quicker."""
        self.page.goto(self.url)
        self.page.get_by_label("Email").fill(self.seed.email)
        self.page.locator("input[type=password]").fill(self.seed.password)
        self.page.keyboard.press("Enter")
        self.page.get_by_role("heading", name="Robots").wait_for()

    @property
    def lease(self) -> Locator:
        return self.page.get_by_test_id("lease-motion")

    def take_control(self) -> None:
        expect(self.lease).to_have_attribute("data-state", "free")
        self.lease.click()
        self.expect_control()

    def expect_control(self) -> None:
        expect(self.lease).to_have_attribute("data-state", "mine")

    def expect_no_control(self) -> None:
        expect(self.lease).not_to_have_attribute("data-state", "mine")

    def hold_keys(self) -> None:
        """Turning in place at the same time keeps the robot off the walls."""
        self.page.keyboard.down("a")
        self.page.keyboard.down("w")

    def release_keys(self) -> None:
        self.page.keyboard.up("w")
        self.page.keyboard.up("a")

    def let_go(self) -> None:
        """Nothing is held any more: no button, no key, no lease."""
        self.page.mouse.up()
        self.release_keys()
        if self.lease.get_attribute("data-state") == "mine":
            self.lease.click()
        self.expect_no_control()

    def drive_off(self, observer: Any) -> None:
        """Hold the keys until the robot moves. What is pressed before the pad allows it moves nothing later, and a page
        that was kept from its processor for a quarter of a second ends the hold and says so: one presses anew."""
        expect(self.page.get_by_test_id("drive-pad")).to_have_attribute("aria-disabled", "false")
        start_s = time.monotonic()
        self.hold_keys()

        def moves() -> bool:
            if self._was_too_slow():
                self.release_keys()
                self.hold_keys()
            return bool(observer.way_m(start_s) > 0.05)

        wait_for(moves, "the robot moves while the key is held")

    def _was_too_slow(self) -> bool:
        return "too slow" in self.page.get_by_test_id("drive-status").inner_text()

    def open_robot(self) -> None:
        self.page.goto(f"{self.url}/robots/{self.seed.robot_id}")
        wait_connected(self.page)
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
