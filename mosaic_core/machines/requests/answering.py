"""Keeps the requests that one handler of the robot still has to answer: each ends once, and only whoever asked hears
of it.

A request has arrived, is admitted when its gates are passed, begins when one of ``at_once`` bodies is free, and ends:
answered, refused, cancelled or out of time. A body may outlast its request; until it returns, its place is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from mosaic_core.machines.requests.request_words import RequestAnswer, RequestProgress, RequestRefusal, RequestReply
from mosaic_core.machines.timing.pacing import NewestThinning
from mosaic_core.words.errors import Refused

MAX_OPEN = 64
"""Requests of all operators that have not ended."""
MAX_OPEN_OF_ONE = 16
"""Of one operator."""
PROGRESS_HZ = 5.0
"""The progress of one request that goes out; within a period the newest counts."""


@dataclass(slots=True)
class _OpenRequest:
    asker: str
    id: str | None
    due_at_s: float
    phase: Literal["arrived", "admitted", "begun"] = "arrived"
    progress: NewestThinning[Any] = field(default_factory=lambda: NewestThinning(PROGRESS_HZ))


@dataclass(frozen=True, slots=True)
class RequestWord:
    """A word for ``asker`` about the request ``number``; ``is_end``: the last one."""

    number: int
    asker: str
    word: RequestReply

    @property
    def is_end(self) -> bool:
        return not isinstance(self.word, RequestProgress)


class Answering:
    """Numbers the requests to one handler. An ``asker`` is a peer. ``within_s``: since it arrived, a request that has
    not ended then is out of time."""

    def __init__(self, at_once: int, within_s: float) -> None:
        self._at_once = at_once
        self._within_s = within_s
        self._numbers = 0
        self._open: dict[int, _OpenRequest] = {}
        self._bodies: set[int] = set()

    def __len__(self) -> int:
        """Requests that have not ended."""
        return len(self._open)

    def __contains__(self, number: object) -> bool:
        """It has not ended."""
        return number in self._open

    # -- from its arrival to its body ----------------------------------------------------------------------------------

    def arrived(self, asker: str, request_id: str | None, now_s: float) -> int:
        """The number of a new request; raises :class:`Refused`."""
        its_own = [one for one in self._open.values() if one.asker == asker]
        if request_id is not None and any(one.id == request_id for one in its_own):
            raise Refused("request.duplicate_id")
        if len(self._open) >= MAX_OPEN or len(its_own) >= MAX_OPEN_OF_ONE:
            raise Refused("request.too_many")
        self._numbers += 1
        self._open[self._numbers] = _OpenRequest(asker, request_id, now_s + self._within_s)
        return self._numbers

    def admitted(self, number: int) -> None:
        if number in self._open:
            self._open[number].phase = "admitted"

    def next_to_begin(self) -> int | None:
        """The oldest admitted request, which begins now; ``None``: none waits, or all places are taken."""
        if len(self._bodies) >= self._at_once:
            return None
        number = next((number for number, one in self._open.items() if one.phase == "admitted"), None)
        if number is not None:
            self._open[number].phase = "begun"
            self._bodies.add(number)
        return number

    def has_body(self, number: int) -> bool:
        """It has begun, and its body has not returned."""
        return number in self._bodies

    def body_returned(self, number: int) -> None:
        """Its place is free."""
        self._bodies.discard(number)

    # -- words ---------------------------------------------------------------------------------------------------------

    def progressed(self, number: int, value: Any, now_s: float) -> RequestWord | None:
        """What of it goes out now."""
        one = self._open.get(number)
        if one is None or (told := one.progress.offer(value, now_s)) is None:
            return None
        return RequestWord(number, one.asker, RequestProgress(one.id, told))

    def answered(self, number: int, answer: Any) -> RequestWord | None:
        """``None``: it had ended before."""
        one = self._open.pop(number, None)
        return None if one is None else RequestWord(number, one.asker, RequestAnswer(one.id, answer))

    def refused(self, number: int, code: str, message: str = "") -> RequestWord | None:
        """``None``: it had ended before."""
        one = self._open.pop(number, None)
        return None if one is None else RequestWord(number, one.asker, RequestRefusal(one.id, code, message))

    def cancelled(self, asker: str, request_id: str) -> RequestWord | None:
        """``None``: this operator has no such request."""
        found = [number for number, one in self._open.items() if one.asker == asker and one.id == request_id]
        return self.refused(found[0], "request.cancelled") if found else None

    def dropped(self, asker: str | None, code: str) -> list[RequestWord]:
        """What had not been admitted will never be: of one operator, or ``None``: of all."""
        return self._refuse_all(code, lambda one: one.phase == "arrived" and asker in (None, one.asker))

    def left(self, asker: str) -> list[int]:
        """Nobody can be told any more: the numbers of the requests that end with that."""
        gone = [number for number, one in self._open.items() if one.asker == asker]
        for number in gone:
            del self._open[number]
        return gone

    def handed_over(self, asker: str, successor: str) -> None:
        """The operator goes on as another peer."""
        for one in self._open.values():
            if one.asker == asker:
                one.asker = successor

    def close(self) -> list[RequestWord]:
        """The handler stops."""
        return self._refuse_all("request.stopped", lambda one: True)

    # -- time ----------------------------------------------------------------------------------------------------------

    @property
    def deadline_s(self) -> float | None:
        """When :meth:`time_passed` has something to do."""
        return min((due_s for one in self._open.values() for due_s in _deadlines(one)), default=None)

    def time_passed(self, now_s: float) -> list[RequestWord]:
        told = self._refuse_all("request.timeout", lambda one: now_s >= one.due_at_s)
        for number, one in self._open.items():
            value = one.progress.due(now_s)
            if value is not None:
                told.append(RequestWord(number, one.asker, RequestProgress(one.id, value)))
        return told

    def _refuse_all(self, code: str, concerns: Any) -> list[RequestWord]:
        numbers = [number for number, one in self._open.items() if concerns(one)]
        return [told for number in numbers if (told := self.refused(number, code)) is not None]


def _deadlines(one: _OpenRequest) -> Iterator[float]:
    yield one.due_at_s
    if one.progress.due_at_s is not None:
        yield one.progress.due_at_s
