"""Asks a request handler, without robot and operator: its body sees what it would see on a robot, on the fake clock."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import json
from dataclasses import dataclass, field
from typing import Any

from mosaic_core.contract.declared.declared_answer import DeclaredAnswer
from mosaic_core.contract.handler import Refused
from mosaic_core.contract.host import Sender
from mosaic_core.contract.request_handler import Request, RequestHandler, answer_type_of
from mosaic_core.harness.fake_hosts import FakeClock, fake_host
from mosaic_core.harness.fake_loop import run_on
from mosaic_core.harness.feed_steps import OPERATOR, RefusedMessage
from mosaic_core.harness.feeding import Feeder
from mosaic_core.harness.right_kind import check_has
from mosaic_core.runtime.handlers.request_bodies import sent_answer
from mosaic_core.words.codes import reason


@dataclass(slots=True)
class Answered:
    """How a request ended: with an ``answer``, or ``refused``."""

    answer: Any = None
    """JSON values, as the operator gets them; ``None`` where it was refused."""
    refused: RefusedMessage | None = None
    """By the model of the question, by the body, or because it was taken back or out of time."""
    progress: list[Any] = field(default_factory=list)
    """All that the body told on the way, as JSON values; an operator gets the newest, five times a second."""
    took_s: float = 0.0
    """Seconds of the fake clock until the body returned."""


def ask(
    handler: RequestHandler[Any, Any], question: Any, *, sender: Sender = OPERATOR, cancel_after_s: float | None = None
) -> Answered:
    """Ask ``handler`` one question, as an operator does, and say how it ended.

    ``question``: a model, a ``dict``, or JSON as ``str`` or ``bytes``; what its model refuses never reaches
    :meth:`~RequestHandler.answer`. ``request.pause`` and, in an ``async`` body, ``asyncio.sleep`` pass on the fake
    clock. ``cancel_after_s``: the operator takes it back so many seconds later; ``answer_within_s`` of the class ends
    it as on a robot. Leases are not asked for here, but by ``joined``. An error other than :class:`Refused` is raised.
    """
    check_has(handler, "answer")
    host = fake_host(handler)
    begin_s = host.clock.now_s
    answered = Answered()
    asked = _Asked(handler, sender, host.clock, cancel_after_s, answered.progress)
    host.arm()
    host.clock.watch(asked)
    try:
        value = Feeder(handler, host).admitted(sender, question).value
        answered.answer = asked.outcome(value)
    except Refused as refused:
        told = refused.message or reason(refused.code).sentence
        answered.refused = RefusedMessage(round(host.clock.now_s - begin_s, 6), refused.code, told)
    finally:
        host.clock.forget(asked)
    answered.took_s = round(host.clock.now_s - begin_s, 6)
    return answered


class _Asked(Request):
    """A request whose pauses pass on the fake clock; also the alarm that takes it back in time."""

    def __init__(
        self,
        handler: RequestHandler[Any, Any],
        sender: Sender,
        clock: FakeClock,
        cancel_after_s: float | None,
        progress: list[Any],
    ) -> None:
        super().__init__(sender, lambda value: progress.append(json.loads(json.dumps(value))))
        self._handler = handler
        self._clock = clock
        is_taken_back = cancel_after_s is not None and cancel_after_s <= handler.answer_within_s
        after_s = cancel_after_s if cancel_after_s is not None and is_taken_back else handler.answer_within_s
        self._code = "request.cancelled" if is_taken_back else "request.timeout"
        self._ends_at_s = clock.now_s + after_s
        if after_s <= 0:
            self.cancel()

    @property
    def due_at_s(self) -> float | None:
        return None if self.is_cancelled else self._ends_at_s

    def ring(self, now_s: float) -> None:
        self.cancel()

    def _wait(self, seconds: float) -> bool:
        if not self.is_cancelled:
            self._clock.advance(max(0.0, min(seconds, self._ends_at_s - self._clock.now_s)))
        return self.is_cancelled

    def outcome(self, question: Any) -> Any:
        """What an operator gets of what the body returns; raises :class:`Refused`, and what the body raises."""
        if inspect.iscoroutinefunction(self._handler.answer):
            answer = run_on(self._clock, lambda: self._as_task(question))
        else:
            answer = self._handler.answer(question, self)
        if self.is_cancelled:
            raise Refused(self._code)
        handler = type(self._handler)
        return sent_answer(DeclaredAnswer(handler, answer_type_of(handler)), answer)

    async def _as_task(self, question: Any) -> Any:
        loop = asyncio.get_running_loop()
        task = loop.create_task(self._handler.answer(question, self))
        ending = loop.call_at(self._ends_at_s, task.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            try:
                return await task
            finally:
                ending.cancel()
        if not self.is_cancelled:
            self.cancel()
        return None
