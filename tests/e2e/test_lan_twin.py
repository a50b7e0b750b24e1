"""A person at a robot with a phone: the robot serves the page itself, a PIN lets the browser in, and it drives."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from support.people import photographed, wait_connected
from support.processes import free_port, mosaic_here
from support.robot_process import RobotProcess

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

YAML = """\
connectors:
  - { type: sim-camera, label: front, params: { fps: 15 } }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
"""
GRAY = """() => {
  const video = document.querySelector('video')
  const canvas = document.createElement('canvas')
  canvas.width = 32; canvas.height = 24
  const context = canvas.getContext('2d')
  context.drawImage(video, 0, 0, 32, 24)
  const rgba = context.getImageData(0, 0, 32, 24).data
  return Array.from({length: 32 * 24}, (_, i) => rgba[4 * i])
}"""


class LanRobot(RobotProcess):
    """`mosaic run --serve` without any server section: no fleet, no account, nothing but the robot."""

    def __init__(self, folder: Path) -> None:
        config = folder / "robot.yaml"
        config.write_text(YAML)
        super().__init__(config, "--serve", f"0.0.0.0:{free_port()}", "--name", "Rover")
        self.environment = {"MOSAIC_DATA_DIR": str(folder)}

    def commands(self) -> int:
        rows = self.snapshots[-1]["connectors"]
        return next(int(row["messages"]) for row in rows if row["label"] == "cmd_vel")

    def lan(self, *words: str) -> str:
        return mosaic_here("lan", *words, **self.environment)

    def offer(self) -> dict[str, Any]:
        shown: dict[str, Any] = json.loads(self.lan("pair", "--no-wait", "--json"))
        return shown


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LanRobot]:
    running = LanRobot(tmp_path_factory.mktemp("lan"))
    running.start()
    running.wait_until_ready(60)
    yield running
    assert running.stop() == 0


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A phone's screen."""
    context = browser.new_context(viewport={"width": 412, "height": 915}, has_touch=True)
    page = context.new_page()
    page.set_default_timeout(20_000)
    yield page
    context.close()


def drive(page: Page, robot: LanRobot, wait_for: Callable[..., float]) -> None:
    """Hold a key until the robot has turned away from what the camera saw."""
    wait_connected(page)
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    before = page.evaluate(GRAY)
    lease = page.get_by_test_id("lease-motion")
    lease.click()
    expect(lease).to_have_attribute("data-state", "mine")
    pad = page.get_by_role("application", name="Drive pad")
    pad.scroll_into_view_if_needed()
    pad.focus()
    page.keyboard.down("a")

    def has_turned() -> bool:
        now = page.evaluate(GRAY)
        return sum(abs(a - b) for a, b in zip(before, now, strict=True)) / len(now) > 8

    wait_for(has_turned, "the picture shows another view", 20)
    page.keyboard.up("a")
    wait_for(lambda: robot.commands() > 5, "the commands are counted", 10)


def copy_from_plain_http(page: Page) -> None:
    """Where browsers give no clipboard to a page."""
    assert not page.evaluate("isSecureContext")
    page.get_by_role("button", name="Connection details").click()
    page.get_by_role("button", name="Copy as JSON").click()
    page.get_by_role("button", name="Copied").wait_for()
    page.evaluate("() => document.body.appendChild(document.createElement('textarea')).focus()")
    page.keyboard.press("Control+V")
    assert json.loads(page.evaluate("() => document.activeElement.value"))


def test_the_pin_pairs_a_browser_which_drives_and_stays_paired_until_it_is_revoked(
    robot: LanRobot, page: Page, wait_for: Callable[..., float]
) -> None:
    offer = robot.offer()
    page.goto(offer["urls"][0])
    page.get_by_role("heading", name="Pair with Rover").wait_for()
    photographed(page, "lan-pin")
    page.get_by_role("textbox", name="PIN").fill("0000 0000" if offer["pin"] != "00000000" else "1111 1111")
    page.get_by_role("button", name="Pair", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("wrong")
    page.get_by_role("textbox", name="PIN").fill(offer["pin"])
    page.get_by_label("Name of this device").fill("Ann's phone")
    page.get_by_role("button", name="Pair", exact=True).click()
    page.get_by_role("heading", name="Robots").wait_for()
    page.get_by_text("Rover").first.click()
    drive(page, robot, wait_for)
    photographed(page, "lan-driving")
    copy_from_plain_http(page)
    page.reload()
    wait_connected(page)
    [device] = json.loads(robot.lan("devices", "list", "--json"))
    assert (device["name"], device["role"]) == ("Ann's phone", "supervisor")
    robot.lan("devices", "revoke", "Ann's phone")
    page.get_by_role("heading", name="Pair with Rover").wait_for()


def test_the_code_of_the_qr_code_pairs_at_once_and_only_once(robot: LanRobot, page: Page, browser: Browser) -> None:
    offer = robot.offer()
    page.goto(offer["page"])
    page.get_by_role("heading", name="Robots").wait_for()
    assert "#" not in page.url
    context = browser.new_context()
    second = context.new_page()
    second.goto(offer["page"])
    expect(second.get_by_role("alert")).to_contain_text("used already")
    context.close()
