"""An operator offers again on its live connection: answered once at a time, and never a reason to end it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.connectors import Camera

from mosaic_core.words import control


@asynccontextmanager
async def played(kit: Any) -> AsyncIterator[Any]:
    async with kit.running(kit.connector_of(Camera("front")), kit.connector_of(Camera("rear"))) as scene:
        yield scene, await scene.enters("ann")


async def test_a_further_offer_is_answered_with_its_number(kit: Any) -> None:
    async with played(kit) as (scene, ann):
        ann.say(control.RenegotiateOffer(attempt=4, sdp="offer:2", tracks={"0": "front", "1": "rear"}))
        assert await ann.hears("renegotiate.answer") == control.RenegotiateAnswer(attempt=4, sdp="answer")
        assert len(scene.network.order) == 1
        ann.say(control.MediaWatch(label="rear", on=True))
        ann.say(control.MediaWatch(label="nothing", on=True))
        assert (await ann.hears("media.unavailable")).label == "nothing"


async def test_one_that_can_not_be_answered_changes_nothing(kit: Any) -> None:
    async with played(kit) as (scene, ann):
        ann.say(control.RenegotiateOffer(attempt=1, sdp="bad"))
        answer = await ann.hears("renegotiate.answer")
        assert (answer.sdp, answer.code) == (None, "sdp.no_common_codec")
        assert scene.robot.peers


async def test_whatever_an_offer_breaks_the_connection_goes_on(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async with played(kit) as (scene, ann):

        async def broken(*_: Any) -> str:
            raise RuntimeError("from somewhere deep inside")

        monkeypatch.setattr(ann.end, "answer", broken)
        ann.say(control.RenegotiateOffer(attempt=1, sdp="offer"))
        assert (await ann.hears("renegotiate.answer")).code == "sdp.invalid"
        assert scene.robot.peers


async def test_offers_in_quick_succession_are_refused(kit: Any) -> None:
    async with played(kit) as (_scene, ann):
        for attempt in range(1, 6):
            ann.say(control.RenegotiateOffer(attempt=attempt, sdp="offer"))
        await ann.hears("renegotiate.answer", 5)
        codes = [answer.code for answer in ann.heard("renegotiate.answer")]
        assert codes.count("signal.too_slow") >= 3


async def test_an_offer_of_eighty_kilobytes_is_taken(kit: Any) -> None:
    async with played(kit) as (_scene, ann):
        ann.say(control.RenegotiateOffer(attempt=1, sdp="offer:2", tracks={str(n): "x" * 400 for n in range(200)}))
        assert (await ann.hears("renegotiate.answer")).sdp == "answer"


FIRST = "offer\r\na=fingerprint:sha-256 AB:CD"


async def test_one_that_comes_through_the_server_is_answered_there_and_shows_an_original_its_new_camera(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    async with kit.running(kit.connector_of(Camera("front"))) as scene:
        socket = await scene.network.ready()
        end = await scene.network.offer(sdp=FIRST)
        end.listener.state_changed("connected")
        end.open("any", "")
        data = {"rtcConnectionId": "p1", "sdpOffer": FIRST}
        socket.push("signaling.send_sdp_offer", data)
        await kit.until(lambda: len(socket.got("signaling.send_sdp_answer")) == 2)
        assert len(scene.network.order) == 1, "no second peer connection"
        assert scene.robot.snapshot().peers[0].watches == ("front",)
        assert [it["status"] for it in socket.got("status.update")] == [0, 1, 2]
        for _ in range(3):
            socket.push("signaling.send_sdp_offer", data)
        await kit.until(lambda: "signal.too_slow" in caplog.text)
        assert len(socket.got("signaling.send_sdp_answer")) < 5
        assert scene.robot.peers
