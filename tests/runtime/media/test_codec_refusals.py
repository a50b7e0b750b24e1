"""A camera whose line is refused: the log names it once, and an operator of ours hears why, whenever it asks."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.connectors import Camera

from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_EXTENSIONS, CONTROL_LABEL, Hello

CAUSE = "The operator offers VP9 on this video line; the robot sends VP8 and H.264."


@asynccontextmanager
async def played(kit: Any) -> AsyncIterator[Any]:
    async with kit.running(kit.connector_of(Camera("front")), kit.connector_of(Camera("rear"))) as scene:
        yield scene


async def test_an_operator_of_ours_hears_it_after_its_hello_and_again_when_it_looks(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    async with played(kit) as scene:
        end = await scene.connects("ann", offer="offer:0")
        end.listener.media.track_refused("front", CAUSE)
        channel = end.open(CONTROL_LABEL)
        channel.say({"type": "hello", "data": Hello(software="t", boot_id="b", extensions=CONTROL_EXTENSIONS).wire()})

        def told() -> list[Any]:
            return [it["data"] for it in channel.values() if it["type"] == "media.unavailable"]

        await kit.until(lambda: {"label": "front", "code": "sdp.no_common_codec", "message": CAUSE} in told())
        channel.say({"type": "media.watch", "data": {"label": "front", "on": True}})
        await kit.until(lambda: [it["label"] for it in told()].count("front") >= 2)
        assert told()[-1]["code"] == "sdp.no_common_codec"
        assert scene.robot.peers
        [line] = [record.message for record in caplog.records if "VP9" in record.message]
        assert line.startswith("front can't be sent to operator ann")


async def test_a_line_that_is_refused_in_a_further_offer_is_told_at_once(kit: Any) -> None:
    async with played(kit) as scene:
        ann = await scene.enters("ann")
        ann.end.listener.media.track_refused("rear", CAUSE)
        told = await ann.hears("media.unavailable")
        assert told == control.MediaUnavailable(label="rear", code="sdp.no_common_codec", message=CAUSE)


async def test_a_camera_that_gets_a_line_after_all_is_refused_no_more(kit: Any) -> None:
    async with played(kit) as scene:
        ann = await scene.enters("ann")
        ann.end.listener.media.track_refused("front", CAUSE)
        await ann.hears("media.unavailable")
        ann.end.listener.media.track_bound("front")
        ann.say(control.MediaWatch(label="front", on=True))
        await kit.until(lambda: scene.robot.snapshot().peers[0].watches == ("front",))
        assert len(ann.heard("media.unavailable")) == 1
