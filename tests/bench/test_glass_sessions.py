"""The bench measures what it says: real pictures through a network of known delay are older by that delay."""

from __future__ import annotations

import asyncio
import base64
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import cv2
import numpy as np
import pytest
from glass_bench.bad_links import Phase
from glass_bench.figures import ages_ms, rank
from glass_bench.page import FLAGS, SCRIPTS
from glass_bench.senders import AIORTC, OURS, Shot, Way
from glass_bench.sessions import from_the_full_rate, session
from playwright.async_api import async_playwright
from playwright.sync_api import Browser

from mosaic_camera.marks import TICK_S, Marks, read_marks
from mosaic_camera.pattern import PatternPainter
from mosaic_core.machines.laboratory.impaired_link import LinkProfile

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]
DELAY_MS = 150.0
TOLERANCE_MS = 60.0
"""A picture more or less, and a busy machine."""
EXCHANGE = """async ([source, width, height, ticks]) => {
  const image = new Image()
  image.src = source
  await image.decode()
  const canvas = Object.assign(document.createElement('canvas'), { width, height })
  Object.assign(canvas, { videoWidth: width, videoHeight: height })
  const onto = canvas.getContext('2d')
  onto.drawImage(image, 0, 0)
  const read = window.readMarks(canvas)
  window.drawMarks(onto, width, height, 8, ticks)
  return [read, canvas.toDataURL('image/png')]
}"""
T = TypeVar("T")


def run(work: Coroutine[Any, Any, T]) -> T:
    """On a thread of its own: a browser of another test may occupy this one's event loop."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


@pytest.mark.parametrize("way", [OURS, AIORTC], ids=lambda way: way.sender)
def test_a_known_delay_is_found_again(chromium: str, way: Way) -> None:
    async def young_age_ms(browser: Any, delay_ms: float) -> float:
        network = LinkProfile("known", delay_ms=delay_ms)
        async with session(browser, None, Shot(way, (320, 240), "pattern", network)) as one:
            await one.displayed(2.0)
            return rank(ages_ms(await one.displayed(2.0)), 0.1)  # a busy machine makes pictures older, none younger

    async def ages() -> list[float]:
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=chromium, args=FLAGS)
            found = await asyncio.gather(*(young_age_ms(browser, delay_ms) for delay_ms in (0.0, DELAY_MS)))
            await browser.close()
            return found

    near_ms, far_ms = run(ages())
    assert near_ms > 0
    assert far_ms - near_ms == pytest.approx(DELAY_MS, abs=TOLERANCE_MS)


def test_a_page_and_the_camera_read_each_others_marks(browser: Browser) -> None:
    page = browser.new_page()
    page.evaluate(SCRIPTS)
    for height in (240, 480, 720):
        width, ticks = height * 4 // 3, 3_000_000_001  # above 2^31: JavaScript's shifts are signed
        _, png = cv2.imencode(".png", PatternPainter(width, height, 30).draw(7, ticks * TICK_S))
        source = "data:image/png;base64," + base64.b64encode(png.tobytes()).decode()
        read, drawn = page.evaluate(EXCHANGE, [source, width, height, ticks])
        assert read == {"frame": 7, "ticks": ticks}
        image = cv2.imdecode(np.frombuffer(base64.b64decode(drawn.partition(",")[2]), np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        assert read_marks(image.astype(np.uint8)) == Marks(8, ticks * TICK_S)
    page.close()


def test_only_vp8_is_told_where_to_begin() -> None:
    offer = "m=video 9 UDP/TLS/RTP/SAVPF 96 97\r\na=rtpmap:96 VP8/90000\r\na=rtpmap:97 H264/90000\r\n"
    assert from_the_full_rate(offer).count("x-google-start-bitrate") == 1
    assert "a=fmtp:96 x-google-start-bitrate" in from_the_full_rate(offer)


def test_phases_become_networks() -> None:
    profile = Phase("3 % loss", loss=0.03).profile
    assert (profile.loss, profile.rate_mbps) == (0.03, None)
