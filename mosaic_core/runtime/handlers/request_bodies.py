"""Runs ``answer`` of a request handler: a ``def`` one on a thread of its own for each request, an ``async`` one as a
task. How many run at once is the caller's to say.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.declared.declared_answer import DeclaredAnswer
from mosaic_core.contract.handler import Refused
from mosaic_core.contract.request_handler import Request, RequestHandler, answer_type_of
from mosaic_core.machines.requests.request_words import MAX_ANSWER_BYTES
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.runtime.handlers.task_runner import leave_behind
from mosaic_core.runtime.threads.error_words import meant_by, said_by, words_of
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S, tell_abandoned
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.threads.stacks import place_of_thread
from mosaic_core.words.errors import DeviceGone
from mosaic_core.words.wire_model import to_json

logger = logging.getLogger(__name__)

NO_DEVICE = "The connector's device isn't available."
"""Where nobody keeps it: it is tried again by the next question alone."""
MAX_KINDS = 32
"""Of wrong answers that are told apart; their words may come from a question, and be without number."""


@dataclass(frozen=True, slots=True)
class BodyReturned:
    """What a body came to: an answer, JSON-ready, or with a ``code`` a refusal."""

    number: int
    answer: Any = None
    code: str = ""
    message: str = ""


def sent_answer(declared: DeclaredAnswer, answer: Any) -> Any:
    """What a body returned, as JSON-ready values that one message takes; raises whatever is wrong with it."""
    plain = declared.plain(answer)
    if len(to_json(plain).encode()) > MAX_ANSWER_BYTES:
        raise Refused("request.answer_too_large")
    return plain


class RequestBodies:
    """Runs the bodies of one handler. Methods on the event loop, and ``returned`` is called there."""

    def __init__(
        self, handler: RequestHandler[Any, Any], failures: Failures, returned: Callable[[BodyReturned], None]
    ) -> None:
        self._label = handler.label
        self._answer = handler.answer
        self._is_async = inspect.iscoroutinefunction(handler.answer)
        self._declared = DeclaredAnswer(type(handler), answer_type_of(type(handler)))
        self._failures = failures
        self._loop = asyncio.get_running_loop()
        self._returned = Handover(self._loop, self._ended)
        self._tell = returned
        self._complaints = ComplaintPace()
        self._kinds: set[str] = set()
        self._keeper = handler.keeper
        self._tasks: dict[int, asyncio.Task[None]] = {}
        self._threads: dict[int, threading.Thread] = {}
        self._running: set[int] = set()
        self._deaf: set[int] = set()
        """Those that go on long after their request has ended."""
        self._idle = asyncio.Event()

    def start(self, number: int, question: Any, request: Request) -> None:
        self._running.add(number)
        self._idle.clear()
        if self._is_async:
            work = self._answer_as_task(number, question, request)
            self._tasks[number] = self._loop.create_task(work, name=f"mosaic-{self._label}-{number}")
        else:
            arguments = (number, question, request)
            name = f"mosaic-{self._label}-{number}"
            thread = threading.Thread(target=self._answer_on_thread, args=arguments, name=name, daemon=True)
            self._threads[number] = thread
            thread.start()

    def cancel(self, number: int) -> None:
        """Its request says so by itself to a ``def`` body."""
        task = self._tasks.get(number)
        if task is not None:
            task.cancel()
        if number in self._running:
            self._loop.call_later(STOP_PATIENCE_S, self._tell_deaf, number)

    def _tell_deaf(self, number: int) -> None:
        """Once, until none is: it keeps a place from others, and nobody else would say why they wait."""
        if number not in self._running:
            return
        if not self._deaf:
            place = self._place_of(number)
            where = f"; it is at {place}" if place else ""
            text = "connector %r still answers a request that ended %.1f s ago (plugin.ignored_stop)%s"
            fields = {"label": self._label, "code": "plugin.ignored_stop"}
            logger.warning(text, self._label, STOP_PATIENCE_S, where, extra=fields)
        self._deaf.add(number)

    def _place_of(self, number: int) -> str:
        thread = self._threads.get(number)
        return "" if thread is None else place_of_thread(thread.ident)

    async def closed(self) -> None:
        """Wait until all that were cancelled have returned, or have been abandoned."""
        if not self._running:
            return
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._idle.wait(), STOP_PATIENCE_S)
        if self._running:
            tell_abandoned(self._label, self._place_of(min(self._running)))
        for task in self._tasks.values():
            leave_behind(task)

    def _ended(self, body: BodyReturned) -> None:
        self._running.discard(body.number)
        self._deaf.discard(body.number)
        self._tasks.pop(body.number, None)
        self._threads.pop(body.number, None)
        if not self._running:
            self._idle.set()
        self._tell(body)

    # -- a thread or task of its own -------------------------------------------------------------------------------

    def _answer_on_thread(self, number: int, question: Any, request: Request) -> None:
        try:
            ended = BodyReturned(number, sent_answer(self._declared, self._answer(question, request)))
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything; every request ends)
            ended = self._refusal(number, request, error)
        self._returned.put(ended)

    async def _answer_as_task(self, number: int, question: Any, request: Request) -> None:
        try:
            ended = BodyReturned(number, sent_answer(self._declared, await self._answer(question, request)))
        except BaseException as error:  # noqa: BLE001 (as above)
            ended = self._refusal(number, request, meant_by(error))
        self._returned.put(ended)

    def _refusal(self, number: int, request: Request, error: BaseException) -> BodyReturned:
        if isinstance(error, Refused):
            return BodyReturned(number, code=error.code, message=error.message)
        if request.is_cancelled:
            return BodyReturned(number, code="request.cancelled")
        if isinstance(error, DeviceGone) and self._keeper is not None:
            self._keeper.lost(error)
        code = "plugin.no_device" if isinstance(error, DeviceGone) else "request.failed"
        self._complain(error, code)
        # what the plugin raised is for the robot's log: it may name files, addresses, passwords
        is_tried_again = code != "plugin.no_device" or self._keeper is not None
        return BodyReturned(number, code=code, message="" if is_tried_again else NO_DEVICE)

    def _complain(self, error: BaseException, code: str) -> None:
        """One line of each kind in a while: of an absence alone, of a bug with the author's line and the traceback."""
        place = self._failures.noted(error, code)
        is_absence = isinstance(error, DeviceGone)
        words, where = (words_of(error), "") if is_absence else (said_by(error), f"{place}; " if place else "")
        is_due = self._complaints.is_due(self._kind(where or words), time.monotonic())
        level = logging.DEBUG if not is_due else logging.WARNING if is_absence else logging.ERROR
        told, fields = (self._label, words, where, code), {"label": self._label, "code": code}
        trace = error if is_due and where else None
        logger.log(level, "connector %r could not answer a request: %s (%s%s)", *told, extra=fields, exc_info=trace)

    def _kind(self, words: str) -> str:
        if len(self._kinds) < MAX_KINDS:
            self._kinds.add(words)
        return words if words in self._kinds else "another"
