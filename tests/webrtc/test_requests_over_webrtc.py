"""Requests over real WebRTC."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core import DataChannelConfigurer, Message, NoParams, Request, RequestHandler
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.testing import connector, joined

pytestmark = pytest.mark.webrtc
WAIT_S = 60.0
MORE_THAN_ONE_PACKET = 40_000


class Repeat(Message):
    text: str
    times: int


class Repeater(RequestHandler[Repeat, str]):
    def answer(self, question: Repeat, request: Request) -> str:
        request.progress({"times": question.times})
        return question.text * question.times


class RepeaterConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Repeater:
        return Repeater(self.label)


async def test_several_requests_are_answered_each_with_its_own_answer() -> None:
    with WebRtcNetwork() as network:
        async with asyncio.timeout(WAIT_S), joined(connector(RepeaterConfigurer), network=network) as link:
            told: list[Any] = []
            asked = [
                link.connection.request("under_test", Repeat(text=text, times=times), on_progress=told.append)
                for text, times in (("a", 1), ("b", MORE_THAN_ONE_PACKET), ("c", 3))
            ]
            assert await asyncio.gather(*asked) == ["a", "b" * MORE_THAN_ONE_PACKET, "ccc"]
            assert {one["times"] for one in told} == {1, MORE_THAN_ONE_PACKET, 3}
