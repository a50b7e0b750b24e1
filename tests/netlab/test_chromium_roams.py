"""A person drives in Chromium, and the address of their machine or of the robot changes: control and data come back
without a click, on the same session."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from laboratory.browser import open_robot
from laboratory.forwarding import Lab
from laboratory.roaming import SILENCE_S, RoamingSite, roaming_site
from playwright.sync_api import Page, expect, sync_playwright

pytestmark = [pytest.mark.e2e, pytest.mark.netlab, pytest.mark.timeout(300)]

BACK_S = 60.0
"""Generous: a browser and two processes share this machine with everything else."""
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
WATCH = """() => {
  const card = document.querySelector('[data-label="counter"]')
  window.seen = []
  setInterval(() => {
    const count = Number(card.querySelector('header').nextElementSibling.textContent.match(/\\d+/)?.[0] ?? -1)
    const age = card.querySelector('[data-testid="age"]').textContent
    window.seen.push({ atMs: performance.now(), count, age })
  }, 40)
}"""
"""Looks at the card 25 times a second: an operator would notice what a test's slow questions miss."""
IS_BACK = """(shortestMs) => {
  const { seen } = window
  const changes = seen.filter(({ count }, i) => i === 0 || count !== seen[i - 1].count).map(({ atMs }) => atMs)
  return changes.slice(1).some((atMs, i) => atMs - changes[i] > shortestMs)
}"""
"""Whether the number on the card stood for so long, and then changed again."""


@pytest.fixture
def roaming(
    tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float], lab: Lab
) -> Iterator[RoamingSite]:
    """Networks of their own: the addresses of the others' stay."""
    with ExitStack() as stack:
        yield roaming_site(Lab(stack), tmp_path_factory.mktemp("roaming"), stack, wait_for)


def roam(page: Page, site: RoamingSite, side: Any, wait_for: Callable[..., float]) -> None:
    """The numbers stand, and come again in time; the lease is there without a click."""
    page.evaluate("() => void window.seen.splice(0)")
    site.cables.move(side)
    page.wait_for_function(IS_BACK, arg=1000 * SILENCE_S, timeout=1000 * BACK_S)
    expect(page.get_by_test_id("lease-motion")).to_have_attribute("data-state", "mine")
    driving_s = time.monotonic()
    page.keyboard.down("w")
    wait_for(lambda: len(site.track.moves(driving_s)) > 3, "the robot moves again", 10)
    page.keyboard.up("w")


def test_control_and_data_come_back_in_a_browser(
    roaming: RoamingSite, chromium: str, wait_for: Callable[..., float]
) -> None:
    def person() -> None:
        with sync_playwright() as playwright:
            page = playwright.chromium.launch(executable_path=chromium, args=QUIET).new_page()
            page.set_default_timeout(20_000)
            open_robot(page, roaming)
            lease = page.get_by_test_id("lease-motion")
            lease.click()
            expect(lease).to_have_attribute("data-state", "mine")
            page.evaluate(WATCH)
            roam(page, roaming, "operator", wait_for)  # the browser's ICE follows by itself
            roam(page, roaming, "robot", wait_for)
            ages = page.evaluate("() => window.seen.map(({ age }) => age)")
            assert any(re.fullmatch(r"reconnecting · .* old", age) for age in ages)

    roaming.lab.operator.run(person)
