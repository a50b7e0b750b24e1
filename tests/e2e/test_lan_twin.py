"""A person at a robot with a phone: the robot serves the page itself, a PIN lets the browser in, and it drives."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import pytest
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
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


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@dataclass
class LanRobot:
    """`mosaic run --serve` without any server section: no fleet, no account, nothing but the robot."""

    folder: Path
    port: int = field(default_factory=free_port)
    snapshots: list[dict[str, Any]] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    readers: list[threading.Thread] = field(default_factory=list)
    process: subprocess.Popen[str] | None = None

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "MOSAIC_DATA_DIR": str(self.folder)}

    def start(self) -> None:
        config = self.folder / "robot.yaml"
        config.write_text(YAML)
        words = [*MOSAIC, "run", str(config), "--serve", f"0.0.0.0:{self.port}", "--name", "Rover", "--json"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(words, env=self.environment, stdout=pipe, stderr=pipe, text=True)
        for stream, take in ((self.process.stdout, self._snapshot), (self.process.stderr, self.log.append)):
            reader = threading.Thread(target=self._read, args=(stream, take), daemon=True)
            reader.start()
            self.readers.append(reader)

    @staticmethod
    def _read(stream: IO[str], take: Callable[[str], None]) -> None:
        with stream:
            for line in stream:
                take(line)

    def close(self) -> None:
        for reader in self.readers:
            reader.join(timeout=5)

    def _snapshot(self, line: str) -> None:
        self.snapshots.append(json.loads(line))

    def is_ready(self) -> bool:
        return bool(self.snapshots) and self.snapshots[-1]["state"] == "ready"

    def commands(self) -> int:
        rows = self.snapshots[-1]["connectors"]
        return next(int(row["messages"]) for row in rows if row["label"] == "cmd_vel")

    def lan(self, *words: str) -> str:
        done = subprocess.run(
            [*MOSAIC, "lan", *words], env=self.environment, capture_output=True, text=True, timeout=60, check=True
        )
        return done.stdout

    def offer(self) -> dict[str, Any]:
        shown: dict[str, Any] = json.loads(self.lan("pair", "--no-wait", "--json"))
        return shown


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float]) -> Iterator[LanRobot]:
    running = LanRobot(tmp_path_factory.mktemp("lan"))
    running.start()
    assert running.process is not None
    wait_for(running.is_ready, "the robot is ready at its own server", 60, alive=running.process, log=running.log)
    yield running
    running.process.terminate()
    assert running.process.wait(timeout=10) == 0
    running.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A phone's screen."""
    context = browser.new_context(viewport={"width": 412, "height": 915}, has_touch=True)
    page = context.new_page()
    page.set_default_timeout(20_000)
    yield page
    context.close()


def shot(page: Page, name: str) -> None:
    folder = os.environ.get("MOSAIC_SCREENSHOTS")
    if folder:
        page.screenshot(path=str(Path(folder) / f"{name}.png"))


def drive(page: Page, robot: LanRobot, wait_for: Callable[..., float]) -> None:
    """Hold a key until the robot has turned away from what the camera saw."""
    page.get_by_text("Connected", exact=True).wait_for()
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


def test_the_pin_pairs_a_browser_which_drives_and_stays_paired_until_it_is_revoked(
    robot: LanRobot, page: Page, wait_for: Callable[..., float]
) -> None:
    offer = robot.offer()
    page.goto(offer["urls"][0])
    page.get_by_role("heading", name="Pair with Rover").wait_for()
    shot(page, "lan-pin")
    page.get_by_role("textbox", name="PIN").fill("0000 0000" if offer["pin"] != "00000000" else "1111 1111")
    page.get_by_role("button", name="Pair", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("wrong")
    page.get_by_role("textbox", name="PIN").fill(offer["pin"])
    page.get_by_label("Name of this device").fill("Ann's phone")
    page.get_by_role("button", name="Pair", exact=True).click()
    page.get_by_role("heading", name="Robots").wait_for()
    page.get_by_text("Rover").first.click()
    drive(page, robot, wait_for)
    shot(page, "lan-driving")
    page.reload()
    page.get_by_text("Connected", exact=True).wait_for()
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
