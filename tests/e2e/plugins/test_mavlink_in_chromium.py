"""A vehicle that is made up in a real Chromium: seen and told to hold."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser, expect
from support.people import photographed, wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]

KINDS = {
    "mavlink-state": "state", "mavlink-odometry": "odometry", "mavlink-battery": "battery", "mavlink-gps": "gps",
    "mavlink-log": "says", "mavlink-command": "command",
}  # fmt: skip
CONNECTORS = "".join(
    f'\n  - {{ type: {kind}, label: {label}, params: {{ url: "fake:" }} }}' for kind, label in KINDS.items()
) + (
    '\n  - { type: mavlink-velocity, label: velocity, params: { url: "fake:" }, safety: { slow_down: off } }\n'
)  # fmt: skip


def test_a_vehicle_is_seen_and_holds_at_the_first_press_of_ask(
    browser: Browser, server: Any, seed: Any, sign_in: Any, start_robot: Any
) -> None:
    start_robot(CONNECTORS, wait=False)
    page = browser.new_context(viewport={"width": 1500, "height": 1300}).new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    page.get_by_text("LOITER").first.wait_for()
    page.get_by_text("A vehicle that is made up is ready").first.wait_for()
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("button", name="You have control")).to_be_visible()
    page.get_by_role("button", name="Ask", exact=True).click()
    expect(page.get_by_label("Answer")).to_contain_text("BRAKE")
    expect(page.get_by_text("BRAKE", exact=True)).to_be_visible()
    photographed(page, "vehicle")
    page.context.close()
