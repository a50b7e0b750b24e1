"""The second peer connection for bulk data, seen from the operator: made when the first bulk store wants it, tried
again with back-off. Nobody waits longer for it than :data:`SETUP_TIMEOUT_S`: then bulk goes over the main connection.

::

    none ──wanted──► connecting ──up──► up
                         ▲   └─────┬─────┘ failure, time-out, silence
                         └──retry── failed
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.peers.peer_events import BulkCloseHeard, BulkFailed, DropBulk, TellBulkClosed
from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed

BulkState = Literal["none", "connecting", "up", "failed"]

SETUP_TIMEOUT_S = 5.0
"""The main connection is up, so a path exists; through a relay it takes about two seconds."""
PING_PERIOD_S = 2.0
LOST_AFTER_S = 8.0
"""Answers to pings wait behind the bulk that SCTP holds, so it is longer than the main connection's; ICE itself needs
up to half a minute."""
STALL_S = 1.0
"""A deadline noticed this late means that our own process stood still; answers may be waiting unread."""
RETRY = BackoffPolicy(first_s=3.0, factor=3.0, max_s=120.0, stable_s=30.0)


@dataclass(frozen=True, slots=True)
class BulkWanted:
    """A bulk store is there."""


@dataclass(frozen=True, slots=True)
class Opened:
    """The connection's own channel is open: everything below it works."""

    attempt: int


@dataclass(frozen=True, slots=True)
class BulkHeard:
    """Something arrived over the second connection."""

    attempt: int


Event = BulkWanted | Opened | BulkHeard | BulkFailed | BulkCloseHeard | DeadlinePassed


@dataclass(frozen=True, slots=True)
class Begin:
    """Make a transport and offer it under this number."""

    attempt: int


@dataclass(frozen=True, slots=True)
class UseBulk:
    """Bulk channels open on the second connection from now on."""


@dataclass(frozen=True, slots=True)
class SendBulkPing:
    """Ask for a sign of life."""


Effect = Begin | UseBulk | SendBulkPing | DropBulk | TellBulkClosed


class OperatorBulkMachine:
    """Decides when the operator makes a second connection, and when bulk goes over the main one.

    ``now_s`` is any monotonic clock, ``draw`` gives random numbers of [0, 1)."""

    def __init__(self, draw: Callable[[], float]) -> None:
        self._draw = draw
        self.state: BulkState = "none"
        self.code = ""
        """Why it failed; empty otherwise."""
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""
        self._attempt = 0
        self._backoff = Backoff(RETRY)
        self._up_at_s = 0.0
        self._ping_at_s = 0.0
        self._lost_at_s = 0.0

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order."""
        match event:
            case BulkWanted():
                return self._begin(now_s) if self.state == "none" else []
            case DeadlinePassed():
                is_due = self.deadline_s is not None and now_s >= self.deadline_s
                return self._overdue(now_s) if is_due else []
            case _ if event.attempt != self._attempt or self.state not in ("connecting", "up"):
                return []
            case Opened():
                return self._opened(now_s)
            case BulkHeard():
                self._heard(now_s)
                return []
            case BulkCloseHeard(_, code):
                return self._failed(code, now_s)
            case BulkFailed(_, code):
                return self._gave_up(code or ("peer.lost" if self.state == "up" else "ice.failed"), now_s)

    def _begin(self, now_s: float) -> list[Effect]:
        self._attempt += 1
        self.state, self.code, self.deadline_s = "connecting", "", now_s + SETUP_TIMEOUT_S
        return [Begin(self._attempt)]

    def _opened(self, now_s: float) -> list[Effect]:
        if self.state == "up":
            return []
        self.state, self._up_at_s = "up", now_s
        self._lost_at_s, self._ping_at_s = now_s + LOST_AFTER_S, now_s + PING_PERIOD_S
        self.deadline_s = self._ping_at_s
        return [UseBulk()]

    def _heard(self, now_s: float) -> None:
        if self.state == "up":
            self._lost_at_s = now_s + LOST_AFTER_S

    def _overdue(self, now_s: float) -> list[Effect]:
        if self.state == "failed":
            return self._begin(now_s)
        if self.state == "connecting":
            return self._gave_up("ice.timeout", now_s)
        late_s = now_s - self._ping_at_s
        if now_s >= self._lost_at_s and late_s <= STALL_S:
            return self._gave_up("peer.lost", now_s)
        if now_s >= self._lost_at_s:
            self._lost_at_s = now_s + PING_PERIOD_S + STALL_S
        self._ping_at_s = self.deadline_s = now_s + PING_PERIOD_S
        return [SendBulkPing()]

    def _gave_up(self, code: str, now_s: float) -> list[Effect]:
        return [TellBulkClosed(self._attempt, code), *self._failed(code, now_s)]

    def _failed(self, code: str, now_s: float) -> list[Effect]:
        ran_for_s = now_s - self._up_at_s if self.state == "up" else 0.0
        self.state, self.code = "failed", code
        self.deadline_s = now_s + self._backoff.failed(ran_for_s, self._draw())
        return [DropBulk()]
