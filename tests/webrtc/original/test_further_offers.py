"""A browser's second offer under the same id: the live connection gets more lines, or stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytestmark = pytest.mark.webrtc

LINK = "  - { type: connection-check, label: link }\n"
CAMERA = "  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 10 } }\n"
OPENED = "open('link-sender'); window.asks = open('link-receiver');"


async def echoed(page: Any, text: str) -> None:
    await page.is_true("asks.readyState === 'open'")
    await page.run(f"asks.send('{text}')")
    await page.is_true(f"got['link-sender'].includes('{text}')")


async def test_a_camera_that_is_asked_for_later_comes_on_the_live_connection(
    original_robot: Any, browser_operator: Any, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(LINK + CAMERA) as site, browser_operator(site) as page:
        await page.begin(OPENED)
        await echoed(page, "before")
        await page.run("pc.addTransceiver('video')")
        await page.offer()
        await page.is_true("pc.getTransceivers()[0].currentDirection === 'recvonly'")
        await page.sees_pictures(0)
        await echoed(page, "after")
        await site.server.sees(0, 1, 2)
    record_property("pair", "our robot ↔ raw page in Chromium: a second offer adds a camera to the live connection")


async def test_data_channels_that_are_asked_for_later_come_too(
    original_robot: Any, browser_operator: Any, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(LINK + CAMERA) as site, browser_operator(site) as page:
        await page.begin("pc.addTransceiver('video')")
        await page.sees_pictures(0)
        await page.run(OPENED)
        await page.offer()
        await echoed(page, "late")
        await page.sees_pictures(0)
        await site.server.sees(0, 1, 2)
    record_property("pair", "our robot ↔ raw page in Chromium: a second offer adds data channels to pictures")


async def test_an_ice_restart_is_refused_and_the_connection_lives(
    original_robot: Any, browser_operator: Any, until: Any, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(LINK) as site, browser_operator(site) as page:
        await page.begin(OPENED)
        await echoed(page, "before")
        await page.run("pc.restartIce()")
        await page.offer()
        await until(lambda: [line for line in site.log if "sdp.invalid" in line], "the refusal")
        await echoed(page, "after")
        await site.server.sees(0, 1, 2)
        assert len(page.answers) == 1
    record_property(
        "pair", "our robot ↔ raw page in Chromium: a second offer with an ICE restart is refused, the peer lives"
    )
