"""A request in a real Chromium: asked on its card, taken back, answered."""

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
