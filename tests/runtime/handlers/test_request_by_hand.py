"""A request typed by hand into an original dashboard, which knows nothing but JSON on a channel."""

from __future__ import annotations

import json
from typing import Any

from pydantic import Field

from mosaic_core import Message, Refused, Request, RequestHandler


class Walk(Message):
    steps: int = Field(ge=0, le=9)


class Walked(Message):
    steps: int


class Walker(RequestHandler[Walk, Walked]):
    async def answer(self, question: Walk, request: Request) -> Walked:
        if question.steps == 7:
            raise Refused("walk.unlucky", "not seven")
        return Walked(steps=question.steps)


async def test_an_original_dashboard_asks_in_plain_json_and_is_answered_or_refused(kit: Any) -> None:
    async with kit.running(kit.connector_of(Walker("walk"))) as scene:
        channel = (await scene.connects("old")).open("walk", "")

        async def said(text: str) -> Any:
            before = len(channel.sent)
            channel.say(text)
            await kit.until(lambda: len(channel.sent) > before)
            return json.loads(channel.sent[-1])

        assert await said('{"steps": 3}') == {"answer": {"steps": 3}}
        assert await said('{"id": "a", "question": {"steps": 4}}') == {"id": "a", "answer": {"steps": 4}}
        assert (await said('{"steps": 7}'))["refused"] == {"code": "walk.unlucky", "message": "not seven"}
        assert (await said('{"steps": 10}'))["refused"]["code"] == "channel.invalid"
        assert (await said("steps"))["refused"]["code"] == "channel.invalid"
