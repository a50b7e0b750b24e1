"""A connector with two cameras and a light in a real Chromium: each of them has its own card, picture and counters."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser, expect
from support.people import photographed, wait_connected
from support.robot_process import RobotProcess, write_config

from mosaic_core.testing.distributions import write_distribution

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

EXAMPLE = Path(__file__).parents[2] / "examples" / "third-party-connector"
EYES = {"left": (160, 40), "right": (320, 200)}
"""Width and brightness of what each eye sees."""
YAML = "  - {{ type: stereo-microscope, label: scope, params: {{ folder: {0}, led: {0}, fps: 10 }} }}\n"
SEES = """([label, width, brightness]) => {
  const video = document.querySelector(`video[aria-label="Picture of ${label}"]`)
  if (video?.videoWidth !== width) return false
  const context = new OffscreenCanvas(1, 1).getContext('2d')
  context.drawImage(video, 0, 0, 1, 1)
  return Math.abs(context.getImageData(0, 0, 1, 1).data[0] - brightness) < 15
}"""
"""Whether the picture has this width and brightness."""


@pytest.fixture
def robot(server: Any, seed: Any, tmp_path: Path) -> Iterator[RobotProcess]:
    """A robot with the example's stereo microscope."""
    for eye, (width, brightness) in EYES.items():
        (tmp_path / eye).mkdir()
        cv2.imwrite(str(tmp_path / eye / "a.png"), np.full((120, width, 3), brightness, np.uint8))
    (tmp_path / "max_brightness").write_text("200\n")
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    write_distribution(tmp_path, project["name"], version=project["version"], entry_points=project["entry-points"])
    robot = RobotProcess(write_config(tmp_path, f"ws://127.0.0.1:{server.port}", seed, YAML.format(tmp_path)))
    robot.environment = {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(EXAMPLE)])}
    robot.start()
    robot.wait_until_ready(60)
    yield robot
    robot.stop()


@pytest.mark.usefixtures("robot")
def test_each_of_two_cameras_and_a_light_of_one_connector_has_its_own_card(
    browser: Browser, server: Any, seed: Any, sign_in: Any
) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    expect(page.get_by_role("region", name=re.compile("^scope_"))).to_have_count(3)
    for eye, (width, brightness) in EYES.items():
        label = f"scope_{eye}"
        expect(page.get_by_role("heading", name=label, exact=True)).to_be_visible()
        page.wait_for_function(SEES, arg=[label, width, brightness])
        page.get_by_role("button", name=f"Menu of {label}").click()
        page.get_by_role("menuitem", name="Delivery").click()
        sheet = page.get_by_role("table", name=f"Delivery of {label}")
        messages = sheet.get_by_role("row", name=re.compile("^messages")).get_by_role("cell").first
        expect(messages).to_have_text(re.compile("^[1-9]"), timeout=20_000)
        page.get_by_role("heading", name=label, exact=True).click()  # not Escape: twice that is a stop
    expect(page.get_by_role("region", name=re.compile("^scope_light:"))).to_be_visible()
    photographed(page, "several-handlers")
    context.close()
