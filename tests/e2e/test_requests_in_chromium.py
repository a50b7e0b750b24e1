"""In a real Chromium: a request is asked on its card, taken back, answered; standard messages have their widgets."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser, expect
from support.people import wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]


def test_a_request_is_asked_taken_back_and_answered(
    browser: Browser, server: Any, seed: Any, sign_in: Any, start_robot: Any
) -> None:
    start_robot("  - { type: sim-survey, label: survey }\n", wait=False)
    page = browser.new_context(viewport={"width": 1100, "height": 800}).new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    duration = page.get_by_label("Duration (s)")
    duration.fill("21")
    expect(page.get_by_text("Duration is at most 20 s")).to_be_visible()
    duration.fill("20")
    page.get_by_role("button", name="Ask").click()
    expect(page.get_by_role("progressbar", name="Progress")).to_be_visible()
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_text("taken back")).to_be_visible()
    page.get_by_role("button", name="Write it as JSON").click()
    page.get_by_label("Question to survey").fill('{"duration_s": 0}')
    page.get_by_role("button", name="Ask").click()
    expect(page.get_by_label("Answer")).to_contain_text("Nearest")
    page.context.close()


STANDARD = """\
  - { type: sim-camera, label: front, params: { width: 320, height: 240, fps: 10 } }
  - { type: sim-map, label: map }
  - { type: sim-path, label: way_home }
  - { type: sim-marks, label: marks, params: { camera: front, width: 320, height: 240 } }
  - { type: sim-mast, label: mast }
  - { type: sim-mast-target, label: mast_target }
  - { type: sim-health, label: health }
"""


def test_whoever_sends_a_standard_message_has_its_widget(
    browser: Browser, server: Any, seed: Any, sign_in: Any, start_robot: Any
) -> None:
    start_robot(STANDARD, wait=False)
    page = browser.new_context(viewport={"width": 1400, "height": 1300}).new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    marks = page.get_by_role("note", name="Marks in front")
    expect(marks).to_contain_text("boxes")
    page.get_by_role("button", name="Hide the marks").click()
    expect(marks).to_have_count(0)
    texts = page.get_by_test_id("map-text")
    expect(texts.filter(has_text="12.0 × 9.0 m")).to_be_visible()
    expect(texts.filter(has_text="way of")).to_be_visible()
    expect(page.get_by_role("list", name="Parts of health").get_by_role("listitem")).to_have_count(3)
    page.get_by_role("button", name="Take control").first.click()
    page.get_by_role("slider", name="mast_pan").fill("1.2")
    page.get_by_role("button", name="Move").click()
    expect(page.get_by_role("region", name="Joints of mast")).to_contain_text("1.200")
    page.context.close()
