"""A page that knows the original's documents alone, in a real Chromium, with a robot of ours behind our server: it
finds everything through `connectorConfig`, shows it, and drives.
"""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser
from support.original_page import connected_page

pytestmark = pytest.mark.e2e

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { fps: 10 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
  - { type: sim-battery, label: battery }
  - { type: sim-laser-scan, label: scan }
  - { type: sim-point-cloud, label: cloud }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
  - { type: connection-check, label: link }
"""


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS)


def test_an_original_page_shows_and_drives_a_robot_of_ours(
    robot: Any, browser: Browser, server: Any, seed: Any
) -> None:
    errors: list[str] = []
    page = connected_page(browser, server, seed, errors)
    page.wait_for_function(
        "() => ['pose', 'battery', 'scan', 'cloud-0', 'link-sender'].every((label) => seen.messages[label])"
    )
    page.wait_for_function("() => document.querySelector('video').videoWidth > 0")
    start = page.evaluate("() => seen.pose")
    page.evaluate("() => { seen.drives = true }")
    page.wait_for_function(
        "(start) => JSON.stringify(seen.pose.position) !== JSON.stringify(start.position)", arg=start
    )
    seen = page.evaluate("() => seen")
    assert seen["tab"].keys() == {"id", "name", "widgets"}
    assert seen["session"].keys() == {"robotId", "rtcSessionId"}
    assert seen["stream"] == "front"
    assert seen["stores"] == {
        "front": "MediaStreamStore",
        "pose": "JsonReceivableStore",
        "battery": "JsonReceivableStore",
        "scan": "JsonReceivableStore",
        "cloud": "PointCloudStore",
        "cmd_vel": "ThumbstickToTwistStore",
        "link-receiver": "ConnectionCheckSenderStore",
        "link-sender": "ConnectionCheckReceiverStore",
    }
    assert set(seen["answered"]) <= {
        "signaling.send_sdp_answer", "signaling.exchange_ice_candidate", "ping.ping", "status.update",
    }  # fmt: skip
    assert errors == []
    page.context.close()
