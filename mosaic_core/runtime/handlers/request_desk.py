"""Takes the requests for one handler from the gates to the answer: what is asked, who hears of it, when it ends.

A question comes the way of a command, through the same gates; here its envelope is opened before them, and what any of
them refuses is told to whoever asked on the connector's own channel too.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from mosaic_core.contract.host import Sender
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.machines.requests.answering import Answering, RequestWord
from mosaic_core.machines.requests.request_words import RequestCancel, RequestRefusal, question_of, reply_text
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.handlers.request_bodies import BodyReturned, RequestBodies
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handover import Handover, on_loop
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.codes import REASONS


@dataclass(slots=True)
class _BegunRequest:
    question: Any
    request: Request
    progress: Any = None
    has_news: bool = False


class RequestDesk:
    """Answers for one handler. Event loop only, but for :meth:`make_safe` and :meth:`dropped`."""

    def __init__(self, handler: RequestHandler[Any, Any], failures: Failures, *, is_motion: bool) -> None:
        """``is_motion``: a stop and the loss of the lease cancel its requests."""
        self._handler = handler
        self._is_motion = is_motion
        self._answering = Answering(handler.at_once, handler.answer_within_s)
        self._asked: dict[int, _BegunRequest] = {}
        """What has begun or will, until its body returns."""
        self._loop = asyncio.get_running_loop()
        self._bodies = RequestBodies(handler, failures, self._returned)
        self._news: Handover[int] = Handover(self._loop, self._progressed)
        self._timer = DeadlineTimer(self._time_passed)
        self._is_closed = False

    # -- on the way of a command -----------------------------------------------------------------------------------

    def opened(self, item: Incoming) -> Incoming | None:
        """``item`` with the question alone; ``None``: it took a request back, which needs no permission. Raises
        :class:`Refused`."""
        word = question_of(item.payload)
        if isinstance(word, RequestCancel):
            self._tell(self._answering.cancelled(item.sender.peer_id, word.id))
            return None
        return replace(item, payload=item.payload if word.id is None else _json(word.question), request_id=word.id)

    def arrived(self, item: Incoming) -> Incoming:
        """It has passed the gates of its arrival; ``item`` with its number. Raises :class:`Refused`."""
        number = self._answering.arrived(item.sender.peer_id, item.request_id, time.monotonic())
        self._set_timer()
        return replace(item, request=number)

    def refused(self, item: Incoming, refusal: GateRefusal) -> None:
        """A gate has refused it."""
        told = self._answering.refused(item.request, refusal.code, refusal.cause) if item.request else None
        if told is not None:
            self._tell(told)
        elif not item.request:
            self._send(item.sender.peer_id, RequestRefusal(item.request_id, refusal.code, refusal.cause))

    async def begin(self, question: Any, item: Incoming) -> None:
        """All gates are passed: it is answered as soon as there is a place."""
        if item.request not in self._answering:  # taken back meanwhile
            return
        request = Request(item.sender, lambda value: self._told(item.request, value))
        self._asked[item.request] = _BegunRequest(question, request)
        self._answering.admitted(item.request)
        self._begin_more()

    def _begin_more(self) -> None:
        while not self._is_closed and (number := self._answering.next_to_begin()) is not None:
            asked = self._asked[number]
            if asked.request.is_cancelled:  # a safe action came first; who asked is about to be told
                self._answering.body_returned(number)
            else:
                self._bodies.start(number, asked.question, asked.request)

    # -- what ends requests ----------------------------------------------------------------------------------------

    def make_safe(self, cause: str) -> None:
        """The safe action, on the safety thread: bodies see at once that they are cancelled."""
        if self._is_motion:
            asked = dict(self._asked)
            for one in asked.values():
                one.request.cancel()
            on_loop(self._loop, lambda: self._refuse(asked, cause))
        self._handler.make_safe(cause)

    def dropped(self, peer_id: str | None, code: str) -> None:
        """What this peer (``None``: anybody) had waiting was dropped before its turn. Any thread."""
        on_loop(self._loop, lambda: self._tell(*self._answering.dropped(peer_id, code)))

    def left(self, peer_id: str) -> None:
        """Nobody is there any more who could be answered; implements ``outbox.Audience``."""
        for number in self._answering.left(peer_id):
            self._cancel(number)
        self._set_timer()

    def handed_over(self, peer_id: str, successor_id: str) -> None:
        """The operator's session goes on with another peer."""
        self._answering.handed_over(peer_id, successor_id)

    def close(self) -> None:
        """The handler stops: whoever waits is told."""
        self._is_closed = True
        self._timer.cancel()
        self._tell(*self._answering.close())
        self._timer.cancel()

    async def closed(self) -> None:
        await self._bodies.closed()

    # -- inside ----------------------------------------------------------------------------------------------------

    def _refuse(self, numbers: Iterable[int], code: str) -> None:
        self._tell(*(self._answering.refused(number, code) for number in numbers))

    def _told(self, number: int, value: Any) -> None:
        """On the body's thread: the newest progress counts, and wakes the event loop once."""
        asked = self._asked.get(number)
        if asked is None:
            return
        asked.progress = value
        if not asked.has_news:
            asked.has_news = True
            self._news.put(number)

    def _progressed(self, number: int) -> None:
        asked = self._asked.get(number)
        if asked is None:
            return
        asked.has_news = False
        self._tell(self._answering.progressed(number, asked.progress, time.monotonic()))

    def _returned(self, body: BodyReturned) -> None:
        self._asked.pop(body.number, None)
        self._answering.body_returned(body.number)
        if body.code:
            self._tell(self._answering.refused(body.number, body.code, body.message))
        else:
            self._tell(self._answering.answered(body.number, body.answer))
        self._begin_more()

    def _time_passed(self) -> None:
        self._tell(*self._answering.time_passed(time.monotonic()))

    def _tell(self, *words: RequestWord | None) -> None:
        """``None``: nobody waits to be told."""
        for one in filter(None, words):
            self._send(one.asker, one.word)
            if one.is_end:
                self._cancel(one.number)
        self._set_timer()

    def _send(self, peer_id: str, word: Any) -> None:
        if isinstance(word, RequestRefusal) and not word.message and word.code in REASONS:
            word = replace(word, message=REASONS[word.code].sentence)
        self._handler.send_json(reply_text(word), to=Sender(peer_id, ""))

    def _cancel(self, number: int) -> None:
        """It has ended: a body that still runs need not go on, one that has not begun never will."""
        asked = self._asked.get(number)
        if asked is None:
            return
        asked.request.cancel()
        self._bodies.cancel(number)
        if not self._answering.has_body(number):
            del self._asked[number]

    def _set_timer(self) -> None:
        if not self._is_closed:
            self._timer.set(self._answering.deadline_s)


def _json(value: Any) -> bytes:
    """As it came, also what is no JSON by the standard: the gate ``shape`` refuses it."""
    return json.dumps(value).encode()
