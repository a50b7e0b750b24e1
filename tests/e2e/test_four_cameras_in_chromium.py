"""Four cameras and a pad: the leading control stands beside the leading picture, and rests where that is not seen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from support.people import Driver, Tabs, wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { width: 160, height: 120, fps: 5 } }
  - { type: test-pattern, label: left, params: { width: 160, height: 120, fps: 5 } }
  - { type: test-pattern, label: right, params: { width: 160, height: 120, fps: 5 } }
  - { type: test-pattern, label: rear, params: { width: 160, height: 120, fps: 5 } }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } } }
"""
SIZES = [(1366, 768), (667, 375)]
BOXES = """() => ['picture', 'control'].map((area) => {
  const place = document.querySelector(`[data-area=${area}][data-leading=true]`)
  const { left, top, right, bottom } = place.getBoundingClientRect()
  return { left, top, right, bottom }
})"""
STATUS, PAD = "drive-status", "drive-pad"
SCROLLED_AWAY = """() => {
  document.body.style.paddingBottom = '2000px'
  window.scrollTo(0, 1000)
}"""


@pytest.fixture
def page(start_robot: Any, tabs: Tabs, server: Any, seed: Any, sign_in: Callable[[Page], None]) -> Any:
    start_robot(CONNECTORS)
    with tabs.lent() as page:
        sign_in(page)
        page.goto(f"{server.url}/robots/{seed.robot_id}")
        wait_connected(page)
        page.wait_for_function("() => document.querySelectorAll('video').length === 4")
        yield page


def test_the_leading_control_stands_beside_the_leading_picture_wholly_on_the_screen(
    page: Page, server: Any, seed: Any
) -> None:
    Driver(page, server.url, seed).take_control()
    status = page.get_by_test_id(STATUS)
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        expect(status).to_have_text("Ready")
        picture, control = page.evaluate(BOXES)
        assert control["left"] >= picture["right"], f"{width}x{height}: beside it"
        assert abs(control["top"] - picture["top"]) < 1, f"{width}x{height}: at the same height"
        for box in (picture, control):
            assert box["left"] >= 0, f"{width}x{height}"
            assert box["top"] >= 0, f"{width}x{height}"
            assert box["right"] <= width, f"{width}x{height}"
            assert box["bottom"] <= height, f"{width}x{height}"
        page.evaluate(SCROLLED_AWAY)
        expect(status).to_contain_text("picture is not on the screen")
        expect(page.get_by_test_id(PAD)).to_have_attribute("aria-disabled", "true")
        page.evaluate("() => window.scrollTo(0, 0)")
        expect(status).to_have_text("Ready")
