"""The robot's page at every size of a screen: who can drive sees where to."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import expect

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

SIZES = [(667, 375), (740, 360), (568, 320), (390, 844), (390, 460), (320, 225), (1024, 600), (1280, 900)]
"""Phones on their side and upright, a window zoomed to 400 %, a small and an ordinary screen."""
SEEN = """(selector) => {
  const element = document.querySelector(selector)
  const { left, top, width, height } = element.getBoundingClientRect()
  const shares = [1 / 6, 3 / 6, 5 / 6]
  const points = shares.flatMap((down) => shares.map((across) => [left + across * width, top + down * height]))
  return points.filter(([x, y]) => element.contains(document.elementFromPoint(x, y))).length / points.length
}"""
"""How much of an element is on the screen with nothing lying over it."""
PICTURE = "[data-area=picture][data-leading=true] [data-testid=video]"
PAD = "[data-testid=drive-pad]"


def test_at_every_size_the_pad_stands_beside_its_picture_and_rests_without_it(driver: Any) -> None:
    page = driver.page
    driver.take_control()
    status = page.get_by_test_id("drive-status")
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        expect(status).to_have_text("Ready")
        seen = {selector: page.evaluate(SEEN, selector) for selector in (PICTURE, PAD)}
        assert seen == {PICTURE: 1, PAD: 1}, f"{width}x{height}"
    page.set_viewport_size({"width": 667, "height": 375})
    page.evaluate("window.scrollTo(0, 600)")
    expect(status).to_contain_text("picture is not on the screen")
    expect(page.locator(PAD)).to_have_attribute("aria-disabled", "true")
    page.evaluate("window.scrollTo(0, 0)")
    expect(status).to_have_text("Ready")
    page.set_viewport_size({"width": 1280, "height": 900})
