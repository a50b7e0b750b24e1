"""Keeps the requests that an operator has sent to one connector: each gets one end, its own.

The ends are the robot's word, a time-out, a cancellation, or the loss of the way to the robot. What the robot says
about a request that has ended, or was never asked, is not for anybody.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.requests.request_words import RequestProgress, RequestReply

MAX_ASKED = 16
"""As many as a robot takes of one operator."""


@dataclass(frozen=True, slots=True)
class LostRequest:
    """The end of the request ``id`` that did not come from the robot."""

    id: str
    code: str


class Asking:
    """Numbers the requests to one connector. ``prefix``: chosen at random, so that two programs of one operator never
    use the same id."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._numbers = 0
        self._due_at_s: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._due_at_s)

    @property
    def has_room(self) -> bool:
        return len(self._due_at_s) < MAX_ASKED

    def asked(self, due_at_s: float) -> str:
        """The id of a new request."""
        self._numbers += 1
        number = f"{self._prefix}-{self._numbers}"
        self._due_at_s[number] = due_at_s
        return number

    def heard(self, reply: RequestReply) -> RequestReply | None:
        """The word, if it is about a request that has not ended; anything but progress ends it."""
        if reply.id is None or reply.id not in self._due_at_s:
            return None
        if not isinstance(reply, RequestProgress):
            del self._due_at_s[reply.id]
        return reply

    def forgotten(self, request_id: str) -> bool:
        """Whoever asked wants no answer any more; ``False``: it had ended before."""
        return self._due_at_s.pop(request_id, None) is not None

    def lost(self, code: str) -> list[LostRequest]:
        """The way to the robot is gone, and with it the answers to all."""
        ended = [LostRequest(number, code) for number in self._due_at_s]
        self._due_at_s.clear()
        return ended

    @property
    def deadline_s(self) -> float | None:
        """When :meth:`time_passed` has something to do."""
        return min(self._due_at_s.values(), default=None)

    def time_passed(self, now_s: float) -> list[LostRequest]:
        ended = [LostRequest(number, "request.timeout") for number, due_s in self._due_at_s.items() if now_s >= due_s]
        for one in ended:
            del self._due_at_s[one.id]
        return ended
