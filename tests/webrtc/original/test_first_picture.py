"""How soon an original operator, aiortc and nothing of ours, sees a camera of our robot."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core.words.control import HELLO_TIMEOUT_S

pytestmark = pytest.mark.webrtc

CAMERA = "  - { type: test-pattern, label: front, params: { width: 640, height: 480, fps: 30 } }\n"
LOAD = "  - { type: host-load, label: load, params: { period_s: 0.1 } }\n"
BOUND_S = 0.75 * HELLO_TIMEOUT_S
"""Far below the time for a hello, which is not waited for; it takes 0.1 to 0.4 s on a machine that has time."""


@pytest.mark.parametrize(
    ("labels", "what"),
    [(("load",), "data and video"), ((), "video alone")],
    ids=["data-and-video", "video-alone"],
)
async def test_the_first_picture_does_not_wait_for_a_hello(
    original_robot: Any, until: Any, labels: tuple[str, ...], what: str, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(CAMERA + LOAD) as site:
        page = site.operator(*labels, videos=1)
        started_at_s = time.monotonic()
        await page.call()
        await until(lambda: page.tracks, "the track")
        picture = await asyncio.wait_for(page.tracks[0].recv(), 20)
        took_s = time.monotonic() - started_at_s
        assert (picture.width, picture.height) == (640, 480)
        record_property("first_picture_s", round(took_s, 2))
        assert took_s < BOUND_S
    record_property("pair", f"our robot ↔ operator on aiortc alone: the first picture at once, {what}")
