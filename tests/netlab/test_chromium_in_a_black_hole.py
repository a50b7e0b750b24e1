"""A person drives in Chromium, and the network swallows everything: the robot stands, and the key still held moves
nothing when the network is back."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from laboratory.browser import open_robot
from playwright.sync_api import Page, expect, sync_playwright
from support.people import wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.netlab, pytest.mark.timeout(120)]

TIMEOUT_S = 0.3
MARGIN_S = 0.5
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]


def drive_until_cut(page: Page, site: Any, wait_for: Callable[..., float]) -> None:
    start_s = time.monotonic()
    page.keyboard.down("w")
    wait_for(lambda: len(site.track.moves(start_s)) > 5, "the robot moves", 10)
    site.lab.cut()


def test_a_key_held_through_a_black_hole_moves_nothing_afterwards(
    site: Any, chromium: str, wait_for: Callable[..., float]
) -> None:
    def person() -> None:
        with sync_playwright() as playwright:
            page = playwright.chromium.launch(executable_path=chromium, args=QUIET).new_page()
            page.set_default_timeout(20_000)
            open_robot(page, site)
            lease = page.get_by_test_id("lease-motion")
            lease.click()
            expect(lease).to_have_attribute("data-state", "mine")
            drive_until_cut(page, site, wait_for)
            wait_for(site.track.stands, "the robot stands", 10)
            assert site.track.silence_s() < TIMEOUT_S + MARGIN_S
            page.get_by_text("Connected", exact=True).wait_for(state="hidden")
            healing_s = time.monotonic()
            site.lab.heal()
            wait_connected(page)
            back_s = time.monotonic()
            wait_for(lambda: time.monotonic() > back_s + 1.0, "time passes, the key is still held")
            assert site.track.moves(healing_s) == []
            page.keyboard.up("w")
            expect(lease).to_have_attribute("data-state", "mine")
            drive_until_cut(page, site, wait_for)

    site.lab.operator.run(person)
