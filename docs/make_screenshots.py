"""Writes `docs/images/*.webp`: the dashboard with the robot of `mosaic demo`, in states that its pages speak of.

`nox -s screenshots` builds the dashboard first. Each state is reached by what a person does, and waited for, so that a
new run shows the same, but for what the simulated robot measures at the time. Needs Chromium (`MOSAIC_CHROMIUM` may
name one), and a machine that has little else to do: the page says when the robot is careful because it is slow.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import httpx
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

IMAGES = Path(__file__).parent / "images"
Scheme = Literal["light", "dark"]
SCHEMES: tuple[Scheme, ...] = ("light", "dark")
DESKTOP = {"viewport": {"width": 1440, "height": 1120}}
WIDE = {"viewport": {"width": 1440, "height": 720}}
PHONE = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 2, "is_mobile": True, "has_touch": True}
QUALITY = 80
"""Of WebP: figures stay sharp, and a picture of the whole page takes less than 100 KB."""
PATIENCE_MS = 60_000
QUIET = ["--headless=new", "--no-sandbox", "--disable-gpu", "--in-process-gpu", "--hide-scrollbars"]
CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
SIGN_IN = "(token) => sessionStorage.setItem('mosaic.accessToken', token)"
DRAWN = """() => {
  const videos = [...document.querySelectorAll('video')]
  const link = document.querySelector('[data-testid=connection] [role=status]')
  return link?.textContent === 'Connected' && videos.length > 0 && videos.every((video) => video.videoWidth > 0)
    && document.querySelectorAll('[aria-busy=true]').length === 0
}"""

CALM = """() => {
  const text = document.body.innerText
  const trip = Number(/Connected\\s+([\\d.]+) ms/.exec(text)?.[1] ?? 0)
  return !/Held still|Slowed|Refused|too slow|Reconnecting|No \\w+ yet|\\d s ago/.test(text) && trip < 40
}"""
"""Nothing is slow: a busy machine makes the robot careful, and its page says so."""


@dataclass(frozen=True)
class Demo:
    """A running `mosaic demo`."""

    url: str
    robot_id: str
    token: str


@contextmanager
def running_demo() -> Iterator[Demo]:
    """Server and simulated robot on free ports; ended by its signal, as with Ctrl+C."""
    words = [sys.executable, "-m", "mosaic_core.cli.main", "demo", "--json", "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            told = json.loads(process.stdout.readline())
            login = {"username": told["email"], "password": told["password"]}
            answer = httpx.post(f"{told['url']}/api/v1/account/login/access-token", json=login).raise_for_status()
            yield Demo(told["url"], told["robotId"], answer.json()["resultData"]["accessToken"])
        finally:
            process.terminate()


@contextmanager
def robot_page(browser: Browser, demo: Demo, scheme: Scheme, screen: dict[str, Any]) -> Iterator[Page]:
    """The robot's page, connected, with its picture."""
    context: BrowserContext = browser.new_context(color_scheme=scheme, reduced_motion="reduce", **screen)
    try:
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(f"{demo.url}/favicon.svg")
        page.evaluate(SIGN_IN, demo.token)
        page.goto(f"{demo.url}/robots/{demo.robot_id}")
        page.wait_for_function(DRAWN)
        yield page
    finally:
        context.close()


def take_control(page: Page) -> None:
    lease = page.get_by_test_id("lease-motion")
    expect(lease).to_have_attribute("data-state", "free", timeout=PATIENCE_MS)
    lease.click()
    expect(lease).to_have_attribute("data-state", "mine", timeout=PATIENCE_MS)


def drive(page: Page, key: str, ms: int) -> None:
    """Hold a key; the robot comes to rest by itself."""
    page.keyboard.down(key)
    page.wait_for_timeout(ms)
    page.keyboard.up(key)


def demo(page: Page) -> None:
    """Whoever has control has driven a little, so that the way is drawn."""
    take_control(page)
    for key, ms in (("a", 600), ("w", 900), ("d", 600), ("s", 600)):
        drive(page, key, ms)


def phone(page: Page) -> None:
    take_control(page)


def stopped(page: Page) -> None:
    """Somebody stopped the robot; the banner says who, and how it is cleared."""
    take_control(page)
    page.get_by_role("button", name="Stop").first.click()
    page.get_by_role("button", name="Hold to clear").first.wait_for()


def widget_menu(page: Page) -> None:
    """The menu of a card, with the other widgets that could show its connector."""
    card = page.locator("[data-label=battery]")
    card.scroll_into_view_if_needed()
    card.get_by_role("button", name="Menu of battery").click()
    page.get_by_role("menu").wait_for()


@dataclass(frozen=True)
class Shot:
    """One picture: what is done before, on which screen, and around which part (all of it where none is named)."""

    name: str
    reach: Callable[[Page], None]
    screen: dict[str, Any]
    margin_of: str | None = None


SHOTS = (
    Shot("demo", demo, DESKTOP),
    Shot("phone", phone, PHONE),
    Shot("stopped", stopped, WIDE),
    Shot("widget-menu", widget_menu, DESKTOP, margin_of="[role=menu]"),
)


def take(browser: Browser, running: Demo, shot: Shot, scheme: Scheme) -> Path:
    """Reach the state and write its picture; the robot is left as it was found."""
    with robot_page(browser, running, scheme, shot.screen) as page:
        shot.reach(page)
        page.mouse.move(0, 0)
        if shot.margin_of is None:
            page.evaluate("() => document.activeElement?.blur()")
        page.wait_for_timeout(1500)  # values and the picture of a robot at rest
        page.wait_for_function(CALM, polling=200)
        picture = page.screenshot(clip=_around(page, shot.margin_of) if shot.margin_of else None)
        _leave(page)
    path = IMAGES / f"{shot.name}-{scheme}.webp"
    Image.open(io.BytesIO(picture)).convert("RGB").save(path, quality=QUALITY, method=6)
    return path


def _around(page: Page, selector: str) -> Any:
    """The card of a menu and the menu itself, with a little of what is around."""
    found = [box for one in (selector, "[data-label=battery]") if (box := page.locator(one).bounding_box()) is not None]
    left, top = min(box["x"] for box in found) - 24, min(box["y"] for box in found) - 24
    right, bottom = max(box["x"] + box["width"] for box in found), max(box["y"] + box["height"] for box in found)
    return {"x": max(0, left), "y": max(0, top), "width": right - left + 24, "height": bottom - top + 24}


def _leave(page: Page) -> None:
    """Nothing stays stopped or held for the next picture."""
    clear = page.get_by_role("button", name="Hold to clear").first
    if clear.is_visible():
        clear.hover()
        page.mouse.down()
        clear.wait_for(state="hidden")
        page.mouse.up()
    lease = page.get_by_test_id("lease-motion")
    if lease.get_attribute("data-state") == "mine":
        lease.click()
        expect(lease).not_to_have_attribute("data-state", "mine", timeout=PATIENCE_MS)


def main() -> int:
    """Take those that are named, or all. Returns the exit code."""
    wanted = sys.argv[1:] or [shot.name for shot in SHOTS]
    if unknown := set(wanted) - {shot.name for shot in SHOTS}:
        print(f"no picture {', '.join(sorted(unknown))}; there are {', '.join(shot.name for shot in SHOTS)}")
        return 2
    chromium = os.environ.get("MOSAIC_CHROMIUM") or next(filter(None, map(shutil.which, CHROMIUM)), None)
    if chromium is None:
        print("no Chromium: apt install chromium, or name one in MOSAIC_CHROMIUM", file=sys.stderr)
        return 1
    with running_demo() as running, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=QUIET)
        for shot in (shot for shot in SHOTS if shot.name in wanted):
            for scheme in SCHEMES:
                path = take(browser, running, shot, scheme)
                print(f"{path.name}: {path.stat().st_size // 1024} KB")
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
