"""An operator with whom no codec is shared: a refused line, a reason in the robot's log, and everything else works."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytestmark = pytest.mark.webrtc

LINK = "  - { type: connection-check, label: link }\n"
CAMERAS = """\
  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 10 } }
  - { type: test-pattern, label: rear, params: { width: 160, height: 120, fps: 10 } }
"""


@pytest.mark.parametrize("codec", ["VP9", "AV1"])
async def test_a_browser_without_our_codecs_gets_a_refused_line_and_its_data(
    original_robot: Any,
    browser_operator: Any,
    until: Any,
    codec: str,
    record_property: Callable[[str, object], None],
) -> None:
    async with original_robot(CAMERAS + LINK) as site, browser_operator(site) as page:
        await page.begin(
            f"only(pc.addTransceiver('video'), '{codec}'); pc.addTransceiver('video');"
            "open('link-sender'); window.asks = open('link-receiver')"
        )
        await page.is_true("asks.readyState === 'open'")
        await page.run("asks.send('hello')")
        await page.is_true("got['link-sender'][0] === 'hello'")
        refused, shown, data = page.answers[0].split("m=")[1:]
        assert refused.startswith("video 0 ")
        assert shown.startswith("video ")
        assert not shown.startswith("video 0 ")
        assert data.startswith("application ")
        await page.sees_pictures(0)  # the browser has put the refused line away
        told = [line for line in site.log if "sdp.no_common_codec" in line]
        assert len(told) == 1
        assert all(word in told[0] for word in ("front", codec, "VP8 and H.264"))
        await page.run("open('late')")
        await page.offer()  # the refused line is in it as one that is given up
        await until(lambda: len(page.answers) == 2, "the further answer")
        await page.run("asks.send('goes on')")
        await page.is_true("got['link-sender'][1] === 'goes on'")
        await site.server.sees(0, 1, 2)
    record_property(
        "pair", f"our robot ↔ raw page in Chromium: a line that offers {codec} alone is refused, the rest works"
    )


async def test_a_browser_that_offers_nothing_else_is_told_so_and_the_robot_is_free_again(
    original_robot: Any, browser_operator: Any, until: Any, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(CAMERAS) as site, browser_operator(site) as page:
        await page.begin("only(pc.addTransceiver('video'), 'VP9')")
        await site.server.sees(0, 1, 0)
        await until(lambda: page.answers, "the answer that refuses")
        assert "m=video 0 " in page.answers[0]
        await page.is_true("pc.signalingState === 'stable'")
        assert [line for line in site.log if "front" in line and "VP9" in line]
    record_property("pair", "our robot ↔ raw page in Chromium: VP9 alone and no data is answered with a refused line")
