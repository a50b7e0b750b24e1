"""The dashboard in Chromium makes a second connection for bulk data to a real robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from support.people import wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

CONNECTORS = """\
  - { type: sim-pose, label: pose, params: { period_s: 0.05 }, delivery: bulk }
  - { type: sim-battery, label: battery }
"""


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS, wait=False)


@pytest.fixture
def page(browser: Browser, robot: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(20_000)
    sign_in(page)
    yield page
    context.close()


def test_bulk_arrives_over_a_connection_of_its_own_and_the_details_say_so(page: Page, server: Any, seed: Any) -> None:
    page.add_init_script(
        """const made = (window.peers = [])
        window.RTCPeerConnection = class extends RTCPeerConnection {
          constructor(...args) { super(...args); this.labels = []; made.push(this) }
          createDataChannel(label, options) { this.labels.push(label); return super.createDataChannel(label, options) }
        }"""
    )
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    page.wait_for_function("() => document.querySelector('[data-testid=trail-text]')?.textContent")
    labels = page.evaluate("() => window.peers.map((one) => one.labels)")
    assert ["_lane", "pose"] in labels
    assert not any("pose" in one and "_mosaic" in one for one in labels)
    page.get_by_role("button", name="Connection details").click()
    expect(page.get_by_test_id("bulk-connection")).to_have_text("Bulk data has a connection of its own.")
