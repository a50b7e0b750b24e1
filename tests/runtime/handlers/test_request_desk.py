"""What the desk of a request handler does where gates, safe actions and cancellations meet."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from typing import Any

import pytest

from mosaic_core.contract.host import Outgoing, Sender, UnboundHost
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.laboratory.joining import until
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.handlers import request_bodies
from mosaic_core.runtime.handlers.request_desk import RequestDesk
from mosaic_core.runtime.threads.failures import Failures

ALICE = Sender("alice", "session")


class Walk(RequestHandler[dict[str, Any], str]):
    at_once = 1

    def __init__(self) -> None:
        super().__init__("walk")
        self.began: list[str] = []
        self.let_go = threading.Event()

    def answer(self, question: dict[str, Any], request: Request) -> str:
        self.began.append(question["to"])
        self.let_go.wait(10)
        return "there"


class Host(UnboundHost):
    def __init__(self) -> None:
        self.sent: list[Any] = []

    def send(self, message: Outgoing) -> bool:
        self.sent.append(json.loads(message.payload))
        return True


def desk_of(handler: Walk) -> tuple[RequestDesk, Host]:
    host = Host()
    handler.bind(host)
    return RequestDesk(handler, Failures("walk", lambda *_: None), is_motion=True), host


def item(request_id: str, to: str) -> Incoming:
    word = {"id": request_id, "question": {"to": to}}
    return Incoming("walk", json.dumps(word).encode(), ALICE, None, 0.0)


async def asked(desk: RequestDesk, request_id: str) -> None:
    opened = desk.opened(item(request_id, request_id))
    assert opened is not None
    arrived = desk.arrived(opened)
    await desk.begin(json.loads(arrived.payload), arrived)


async def test_what_a_safe_action_found_waiting_never_begins() -> None:
    walk = Walk()
    desk, host = desk_of(walk)
    await asked(desk, "1")
    await asked(desk, "2")
    await until(lambda: walk.began == ["1"])
    await asyncio.to_thread(desk.make_safe, "safety.stop")
    walk.let_go.set()
    await until(lambda: len(host.sent) == 2)
    await desk.closed()
    assert walk.began == ["1"]
    assert [(one["id"], one["refused"]["code"]) for one in host.sent] == [("1", "safety.stop"), ("2", "safety.stop")]


async def test_what_was_taken_back_before_its_turn_never_begins() -> None:
    walk = Walk()
    desk, host = desk_of(walk)
    opened = desk.opened(item("1", "a"))
    assert opened is not None
    arrived = desk.arrived(opened)
    cancel = Incoming("walk", b'{"id": "1", "cancel": true}', ALICE, None, 0.0)
    assert desk.opened(cancel) is None
    await desk.begin({"to": "a"}, arrived)
    assert (walk.began, desk._asked) == ([], {})
    assert [one["refused"]["code"] for one in host.sent] == ["request.cancelled"]


async def test_all_that_wait_are_told_when_the_handler_stops() -> None:
    walk = Walk()
    desk, host = desk_of(walk)
    await asked(desk, "1")
    await asked(desk, "2")
    desk.close()
    assert [one["refused"]["code"] for one in host.sent] == ["request.stopped", "request.stopped"]
    walk.let_go.set()
    await desk.closed()
    assert walk.began == ["1"]


async def test_a_body_that_goes_on_after_its_request_is_told_once_with_its_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(request_bodies, "STOP_PATIENCE_S", 0.05)
    walk = Walk()
    desk, _ = desk_of(walk)
    await asked(desk, "1")
    await until(lambda: walk.began == ["1"])
    assert desk.opened(Incoming("walk", b'{"id": "1", "cancel": true}', ALICE, None, 0.0)) is None
    with caplog.at_level(logging.WARNING):
        await until(lambda: caplog.records)
    line = Walk.answer.__code__.co_firstlineno + 2
    (record,) = caplog.records
    assert record.message == (
        "connector 'walk' still answers a request that ended 0.1 s ago (plugin.ignored_stop); it is at "
        f"{__file__}:{line} in Walk.answer"
    )
    walk.let_go.set()
    await desk.closed()


async def test_a_body_that_ends_with_its_request_is_not_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(request_bodies, "STOP_PATIENCE_S", 0.01)
    walk = Walk()
    desk, host = desk_of(walk)
    walk.let_go.set()
    await asked(desk, "1")
    await until(lambda: host.sent)
    await desk.closed()
    await asyncio.sleep(0.05)  # long after it would have been told
    assert caplog.records == []
