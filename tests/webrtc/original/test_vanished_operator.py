"""An original operator that is gone frees the robot soon, with the true reason; one that lives is never dropped."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core.machines.peers.consent import LOST_AFTER_S

pytestmark = pytest.mark.webrtc

LINK = "  - { type: connection-check, label: link }\n"
CAMERA = "  - { type: test-pattern, label: front, params: { width: 160, height: 120, fps: 10 } }\n"
FREED_WITHIN_S = 16.0
SILENT_S = 2 * FREED_WITHIN_S


@pytest.mark.parametrize("videos", [0, 1], ids=["data", "pictures"])
async def test_an_operator_whose_network_is_gone_is_lost_within_the_bound(
    original_robot: Any, until: Any, videos: int, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(LINK + CAMERA) as site:
        page = site.operator("link-sender", "link-receiver", videos=videos)
        await page.connect()
        await site.server.sees(0, 1, 2)
        page.vanish()
        gone_at_s = time.monotonic()
        await site.server.sees(0, 1, 2, 3, 0, timeout_s=FREED_WITHIN_S + 20)
        took_s = time.monotonic() - gone_at_s
        record_property("freed_after_s", round(took_s, 1))
        assert LOST_AFTER_S - 4 < took_s < FREED_WITHIN_S
        await until(lambda: [line for line in site.log if f"{page.id} left (peer.lost)" in line], "the true code")
    record_property("pair", "our robot ↔ operator on aiortc alone: one that vanished frees the robot within 16 s")


async def test_a_silent_operator_and_one_whose_network_stalls_are_kept(
    original_robot: Any, until: Any, record_property: Callable[[str, object], None]
) -> None:
    """Silent: it opens its channels, sends nothing ever, and asks for no consent itself; it only answers."""

    async def silent() -> None:
        async with original_robot(LINK) as site:
            page = site.operator("link-sender", "link-receiver")
            await page.connect()
            page._ice()._query_consent_task.cancel()
            await asyncio.sleep(SILENT_S)
            await echoed(site, page)

    async def stalled() -> None:
        async with original_robot(LINK) as site:
            page = site.operator("link-sender", "link-receiver")
            await page.connect()
            for _ in range(2):
                back = page.vanish()
                await asyncio.sleep(LOST_AFTER_S - 4)
                back()
                await echoed(site, page)

    async def echoed(site: Any, page: Any) -> None:
        before = len(page.received["link-sender"])
        page.channels["link-receiver"].send("still here")
        await until(lambda: len(page.received["link-sender"]) > before, "the echo")
        assert site.server.statuses == [0, 1, 2]

    await asyncio.gather(silent(), stalled())
    record_property(
        "pair", "our robot ↔ operator on aiortc alone: silent for long, or stalled for 10 s, it stays connected"
    )
