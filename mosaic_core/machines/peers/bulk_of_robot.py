"""The second peer connection of one operator, seen from the robot: one at a time, not too often, every phase bounded.

::

    none ──offer──► answering ──answered──► connecting ──connected──► up
    any ──failure, time-out, close, a newer offer──► none

It carries data channels only. An offer that comes again, or late, has an old number and is ignored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.peers.peer_events import BulkCloseHeard, BulkFailed, DropBulk, TellBulkClosed
from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.signaling import IceCandidate

Phase = Literal["none", "answering", "connecting", "up"]

SETUP_TIMEOUT_S = 10.0
"""From the offer to the connection; the operator gives up earlier (``machines.peers.bulk_of_operator``)."""
MAX_OFFERS_HZ = 0.5
"""An operator's second try comes after two seconds, the next ones later."""
MAX_CANDIDATES = 64
"""A browser has about ten; more is somebody filling our memory."""


@dataclass(frozen=True, slots=True)
class OfferHeard:
    """The operator offered a bulk connection."""

    attempt: int
    sdp: str


@dataclass(frozen=True, slots=True)
class CandidateHeard:
    """The operator sent an ICE candidate of the bulk connection."""

    attempt: int
    candidate: IceCandidate


@dataclass(frozen=True, slots=True)
class BulkAnswerMade:
    """Our answer is on its way."""

    attempt: int


@dataclass(frozen=True, slots=True)
class Connected:
    """The bulk connection is up."""

    attempt: int


Event = OfferHeard | CandidateHeard | BulkCloseHeard | BulkAnswerMade | BulkFailed | Connected | DeadlinePassed


@dataclass(frozen=True, slots=True)
class AnswerOffer:
    """Make a transport for this offer."""

    attempt: int
    sdp: str


@dataclass(frozen=True, slots=True)
class AddBulkCandidate:
    """Give the bulk connection an ICE candidate of the operator."""

    candidate: IceCandidate


Effect = AnswerOffer | AddBulkCandidate | DropBulk | TellBulkClosed


def is_data_only(sdp: str) -> bool:
    """Whether no line of an offer is for pictures or sound."""
    lines = [line for line in sdp.splitlines() if line.startswith("m=")]
    return len(lines) <= 1 and all(line.startswith("m=application ") for line in lines)


class RobotBulkMachine:
    """Decides which offers of a second connection a robot answers. ``now_s`` is any monotonic clock."""

    def __init__(self) -> None:
        self.phase: Phase = "none"
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""
        self._attempt = 0
        self._candidates = 0
        self._rate = TokenBucket.of_rate(MAX_OFFERS_HZ)

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order."""
        match event:
            case OfferHeard(attempt, sdp):
                return self._offered(attempt, sdp, now_s) if attempt > self._attempt else []
            case DeadlinePassed():
                is_due = self.deadline_s is not None and now_s >= self.deadline_s
                return self._failed("ice.timeout", "") if is_due else []
            case _:
                is_current = event.attempt == self._attempt and self.phase != "none"
                return self._of_current(event, now_s) if is_current else []

    def _of_current(
        self, event: CandidateHeard | BulkCloseHeard | BulkAnswerMade | BulkFailed | Connected, now_s: float
    ) -> list[Effect]:
        match event:
            case CandidateHeard(_, candidate):
                self._candidates += 1
                return [AddBulkCandidate(candidate)] if self._candidates <= MAX_CANDIDATES else []
            case BulkCloseHeard():
                return self._ended()
            case BulkAnswerMade() if self.phase == "answering":
                self.phase = "connecting"
            case Connected():
                self.phase, self.deadline_s = "up", None
            case BulkFailed(_, code, message):
                return self._failed(code or ("peer.lost" if self.phase == "up" else "ice.failed"), message)
            case _:
                pass
        return []

    def _offered(self, attempt: int, sdp: str, now_s: float) -> list[Effect]:
        ended = self._ended() if self.phase != "none" else []
        self._attempt, self._candidates = attempt, 0
        if not self._rate.admits(now_s):
            return [*ended, TellBulkClosed(attempt, "lane.refused", "too many attempts")]
        if not is_data_only(sdp):
            return [*ended, TellBulkClosed(attempt, "sdp.invalid", "the second connection carries data channels only")]
        self.phase, self.deadline_s = "answering", now_s + SETUP_TIMEOUT_S
        return [*ended, AnswerOffer(attempt, sdp)]

    def _failed(self, code: str, message: str) -> list[Effect]:
        return [*self._ended(), TellBulkClosed(self._attempt, code, message)]

    def _ended(self) -> list[Effect]:
        self.phase, self.deadline_s = "none", None
        return [DropBulk()]
