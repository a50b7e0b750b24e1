"""The life of one peer connection, seen from the operator: every phase is bounded, every end has a code.

::

    offering ──offered──► waiting ──answered──► connecting ──securing──► securing ──connected──► greeting
    greeting ──hello──► open        greeting ──2 s──► original ──late hello──► open
    greeting ──8 s without a channel──► closed
    any phase ──failure, time-out, silence, bye, request──► closed

A robot of ours answers pings, so two seconds without a word mean that it is lost; an original one is trusted to ICE.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.peers.peer_events import ControlReceived as ControlReceived
from mosaic_core.machines.peers.peer_events import Doubted as Doubted
from mosaic_core.machines.peers.peer_events import HelloReceived as HelloReceived
from mosaic_core.machines.peers.peer_events import TransportChanged as TransportChanged
from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.words.control import HELLO_TIMEOUT_S, PEER_LOST_AFTER_S, PING_PERIOD_S

Phase = Literal[
    "offering", "waiting", "connecting", "securing", "greeting", "open", "original", "closed",
]  # fmt: skip

TIMEOUTS: dict[Phase, tuple[float, str]] = {
    "offering": (15.0, "sdp.timeout"),
    "waiting": (20.0, "signal.no_answer"),
    "connecting": (20.0, "ice.timeout"),
    "securing": (10.0, "dtls.timeout"),
}
"""Seconds a phase may take, and the code when it takes longer. Either side may first wait for a TURN server."""
CHANNEL_TIMEOUT_S = 8.0
"""From the connection to the open control channel. Only then does silence mean an original robot."""
KNOWN_ORIGINAL_S = 0.3
"""For the hello of a robot that said none on the connection before: a round trip of a bad link."""
STALL_S = 0.5
"""A deadline noticed this late means that our own process stood still; answers may be waiting unread."""


@dataclass(frozen=True, slots=True)
class OfferMade:
    """The offer is on its way."""


@dataclass(frozen=True, slots=True)
class AnswerReceived:
    """The robot's answer is applied."""


@dataclass(frozen=True, slots=True)
class ControlOpened:
    """The control channel is open on our side."""


@dataclass(frozen=True, slots=True)
class EndReceived:
    """The robot, or the server for it, ends the connection; or it could not be made."""

    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class EndRequested:
    """Our own program wants the connection ended."""


@dataclass(frozen=True, slots=True)
class PatienceLost:
    """Whoever waits for the connection waits no longer; the phase names the code."""


@dataclass(frozen=True, slots=True)
class RobotReturned:
    """The robot has a new connection to the server: what was sent over the one before has perhaps not reached it."""


Event = (
    OfferMade | AnswerReceived | TransportChanged | ControlOpened | HelloReceived | ControlReceived | EndReceived
    | EndRequested | PatienceLost | Doubted | RobotReturned | DeadlinePassed
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class SendPing:
    """Ask for a sign of life."""


@dataclass(frozen=True, slots=True)
class UseConnection:
    """Connectors may be opened; ``is_ours``: the robot speaks ``mosaic.1``."""

    is_ours: bool


@dataclass(frozen=True, slots=True)
class End:
    """Close everything. ``tells_robot``: it may not know yet."""

    code: str
    message: str
    tells_robot: bool


Effect = SendPing | UseConnection | End


class OperatorPeerMachine:
    """Decides when the operator pings, trusts and gives up a peer connection. ``now_s`` is any monotonic clock.

    ``was_original``: the robot said no hello a moment ago, so that it is not waited for long now; a late one counts all
    the same."""

    def __init__(self, now_s: float, *, was_original: bool = False) -> None:
        self._hello_s = KNOWN_ORIGINAL_S if was_original else HELLO_TIMEOUT_S
        self.phase: Phase = "offering"
        self.deadline_s: float | None = now_s + TIMEOUTS["offering"][0]
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""
        self._has_control = False
        self._ping_at_s = 0.0
        self._lost_at_s = 0.0

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order."""
        if self.phase == "closed":
            return []
        match event:
            case OfferMade() if self.phase == "offering":
                return self._enter("waiting", now_s)
            case AnswerReceived() if self.phase == "waiting":
                return self._enter("connecting", now_s)
            case TransportChanged(state):
                return self._transport(state, now_s)
            case ControlOpened():
                return self._control_opened(now_s)
            case HelloReceived() if self.phase in ("greeting", "original"):
                return self._opened(now_s)
            case HelloReceived() | ControlReceived():
                self._heard(now_s)
                return []
            case EndReceived(code, message):
                return self._end(code, message, tells_robot=False)
            case EndRequested():
                return self._end("peer.closed", "", tells_robot=True)
            case PatienceLost():
                code = TIMEOUTS.get(self.phase, (0.0, "channel.timeout"))[1]
                self.phase, self.deadline_s = "closed", None
                return [End(code, "", tells_robot=True)]  # the server knows of it, even if the robot does not yet
            case Doubted(patience_s):
                return self._doubted(now_s + patience_s, now_s)
            case RobotReturned() if self.phase == "waiting":
                return self._end("signal.timeout", "", tells_robot=True)
            case DeadlinePassed():
                return self._overdue(now_s)
            case _:
                return []

    def _transport(self, state: str, now_s: float) -> list[Effect]:
        match state:
            case "securing" if self.phase == "connecting":
                return self._enter("securing", now_s)
            case "connected" if self.phase in ("waiting", "connecting", "securing"):
                self.phase = "greeting"
                self.deadline_s = now_s + (self._hello_s if self._has_control else CHANNEL_TIMEOUT_S)
                return []
            case "failed":
                is_up = self.phase in ("greeting", "open", "original")
                code = "peer.lost" if is_up else "dtls.failed" if self.phase == "securing" else "ice.failed"
                return self._end(code, "", tells_robot=True)
            case "closed":
                return self._end("peer.closed", "", tells_robot=False)
            case _:
                return []

    def _control_opened(self, now_s: float) -> list[Effect]:
        """Browsers and aiortc don't promise whether this or the state ``connected`` is told first."""
        self._has_control = True
        if self.phase == "greeting":
            self.deadline_s = now_s + self._hello_s
        return []

    def _enter(self, phase: Phase, now_s: float) -> list[Effect]:
        self.phase, self.deadline_s = phase, now_s + TIMEOUTS[phase][0]
        return []

    def _opened(self, now_s: float) -> list[Effect]:
        self.phase = "open"
        self._lost_at_s = now_s + PEER_LOST_AFTER_S
        return [UseConnection(is_ours=True), *self._ping(now_s)]

    def _ping(self, now_s: float) -> list[Effect]:
        self._ping_at_s = now_s + PING_PERIOD_S
        self.deadline_s = min(self._ping_at_s, self._lost_at_s)
        return [SendPing()]

    def _heard(self, now_s: float) -> None:
        if self.phase == "open":
            self._lost_at_s = now_s + PEER_LOST_AFTER_S
            self.deadline_s = min(self._ping_at_s, self._lost_at_s)

    def _doubted(self, lost_at_s: float, now_s: float) -> list[Effect]:
        if self.phase != "open":
            return []
        self._lost_at_s = min(self._lost_at_s, lost_at_s)
        return self._ping(now_s)

    def _overdue(self, now_s: float) -> list[Effect]:
        if self.deadline_s is None or now_s < self.deadline_s:
            return []
        if self.phase == "greeting":
            if not self._has_control:
                return self._end("channel.timeout", "", tells_robot=True)
            self.phase, self.deadline_s = "original", None
            return [UseConnection(is_ours=False)]
        if self.phase == "open":
            return self._overdue_open(now_s)
        return self._end(TIMEOUTS[self.phase][1], "", tells_robot=True)

    def _overdue_open(self, now_s: float) -> list[Effect]:
        if now_s < self._lost_at_s:
            return self._ping(now_s)
        if now_s - min(self._ping_at_s, self._lost_at_s) > STALL_S:
            self._lost_at_s = now_s + PEER_LOST_AFTER_S
            return self._ping(now_s)
        return self._end("peer.lost", "", tells_robot=True)

    def _end(self, code: str, message: str, *, tells_robot: bool) -> list[Effect]:
        was_offered = self.phase != "offering"
        self.phase, self.deadline_s = "closed", None
        return [End(code, message, tells_robot and was_offered)]
