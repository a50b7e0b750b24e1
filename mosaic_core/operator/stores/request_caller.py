"""Asks one connector of a robot, and hands every answer to whoever asked. Event loop only."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pydantic import BaseModel

from mosaic_core.machines.delivery.finite_message import finite
from mosaic_core.machines.requests.asking import Asking, LostRequest
from mosaic_core.machines.requests.request_words import (
    MAX_QUESTION_BYTES,
    RequestAnswer,
    RequestCancel,
    RequestProgress,
    RequestQuestion,
    RequestRefusal,
    question_text,
    reply_of,
)
from mosaic_core.operator.stores.mosaic_store import Gap
from mosaic_core.operator.stores.stores import BidirectionalStore
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.codes import REASONS, reason
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.wire_model import to_json

TellProgress = Callable[[Any], object]


class RequestFailed(MosaicError):
    """A request without an answer: out of time, or the way to the robot is lost. Whether the robot carried it out,
    nobody knows."""

    def __init__(self, code: str) -> None:
        super().__init__(reason(code).sentence, code=code)


class RequestRefused(MosaicError):
    """A request that the robot refused; ``code`` and text are the robot's, or the connector's own."""

    def __init__(self, code: str, message: str) -> None:
        known = REASONS.get(code)
        super().__init__(
            message or (known.sentence if known else code), code=code, cure=known.cure if known is not None else ""
        )


class RequestCaller:
    """Asks by one store, which it listens to for good."""

    def __init__(self, store: BidirectionalStore) -> None:
        self._store = store
        self._asking = Asking(secrets.token_hex(4))
        self._waiting: dict[str, tuple[asyncio.Future[Any], TellProgress | None]] = {}
        self._timer = DeadlineTimer(lambda: self._end(self._asking.time_passed(time.monotonic())))
        store.subscribe(self._heard)
        store.on_after_disconnected(self._disconnected)
        store.on_gap(self._missed)
        store.warns_of_gaps = False  # whoever asked hears of it, as the end of the request

    async def request(
        self,
        question: BaseModel | Mapping[str, Any] | list[Any],
        timeout_s: float,
        on_progress: TellProgress | None = None,
    ) -> Any:
        """See :meth:`RobotConnection.request`."""
        due_at_s = time.monotonic() + timeout_s
        plain = question.model_dump(mode="json") if isinstance(question, BaseModel) else question
        if len(_json(plain).encode()) > MAX_QUESTION_BYTES - 256:
            raise RequestFailed("request.too_large")
        if self._store.state.phase != "open":
            await self._store.wait_open(timeout_s)
        if not self._asking.has_room:
            raise RequestFailed("request.too_many")
        number = self._asking.asked(due_at_s)
        if not self._store.send_json(question_text(RequestQuestion(number, plain))):
            self._asking.forgotten(number)
            raise RequestFailed("request.not_sent")
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._waiting[number] = future, on_progress
        self._timer.set(self._asking.deadline_s)
        try:
            return await future
        finally:
            self._forget(number)

    def close(self) -> None:
        """The connection has ended for good."""
        self._end(self._asking.lost("request.lost"))

    def _forget(self, number: str) -> None:
        """It has ended, or whoever asked has gone."""
        del self._waiting[number]
        if self._asking.forgotten(number):
            self._take_back(number)
        self._timer.set(self._asking.deadline_s)

    def _take_back(self, number: str) -> None:
        self._store.send_json(question_text(RequestCancel(number)))

    def _heard(self, data: bytes) -> None:
        reply = reply_of(data)
        reply = None if reply is None else self._asking.heard(reply)
        if reply is None or reply.id not in self._waiting:
            return
        future, on_progress = self._waiting[reply.id]
        match reply:
            case RequestProgress():
                if on_progress is not None and not future.done():
                    on_progress(reply.progress)
            case RequestAnswer():
                _settle(future, reply.answer)
            case RequestRefusal():
                _settle(future, RequestRefused(reply.code, reply.message))

    def _disconnected(self) -> None:
        if self._store.state.phase != "reconnecting" or not self._store.outlives_connection:
            self._end(self._asking.lost("request.lost"))

    def _missed(self, gap: Gap) -> None:
        """Some of what was asked or answered will never arrive, and nobody knows which."""
        self._end(self._asking.lost("request.lost"))

    def _end(self, lost: Iterable[LostRequest]) -> None:
        for one in lost:
            if one.code == "request.timeout":
                self._take_back(one.id)
            if one.id in self._waiting:
                _settle(self._waiting[one.id][0], RequestFailed(one.code))
        self._timer.set(self._asking.deadline_s)


def _json(question: Any) -> str:
    """The question as JSON; raises :class:`MosaicError` for numbers that JSON does not know."""
    try:
        return to_json(question)
    except ValueError:
        fields = ", ".join(finite(question, None)[1])
        if not fields:
            raise
        message = f"the question holds what is no finite number: {fields}"
        raise MosaicError(message, code="safety.not_finite") from None


def _settle(future: asyncio.Future[Any], outcome: Any) -> None:
    if future.done():
        return
    if isinstance(outcome, MosaicError):
        future.set_exception(outcome)
    else:
        future.set_result(outcome)
