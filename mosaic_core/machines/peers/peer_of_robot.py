"""The life of one operator's peer connection, seen from the robot: every phase is bounded, every end has a code.

::

    answering ──answered──► connecting ──securing──► securing ──connected──► greeting ──hello──► open
                                       greeting ──certain, or 2 s after a bare channel──► original ──late hello──┘
                                       greeting ──10 s without a channel, or without the hello──► closed
    any phase ──failure, time-out, bye, request──► closed

An original operator is known for certain by an offer without a line for data channels, or by its first channel: that
of an operator of ours is always `_mosaic`. Being slow makes nobody an original: it would cost an operator of ours its
lease. An operator of ours pings, so silence means it is lost; an original one is trusted to ICE.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.peers.peer_events import ControlReceived as ControlReceived
from mosaic_core.machines.peers.peer_events import Doubted as Doubted
from mosaic_core.machines.peers.peer_events import HelloReceived as HelloReceived
from mosaic_core.machines.peers.peer_events import TransportChanged as TransportChanged
from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.words.control import HELLO_TIMEOUT_S, PEER_LOST_AFTER_S

Phase = Literal["answering", "connecting", "securing", "greeting", "open", "original", "closed"]

TIMEOUTS: dict[Phase, tuple[float, str]] = {
    "answering": (15.0, "sdp.timeout"),
    "connecting": (20.0, "ice.timeout"),
    "securing": (10.0, "dtls.timeout"),
}
"""Seconds a phase may take, and the code when it takes longer. Relay-only answers wait for the TURN server."""
CHANNEL_TIMEOUT_S = 10.0
"""From the connection to the hello, or to the first channel of an original: their set-up may be repeated."""
STALL_S = 0.5
"""A deadline noticed this late means that our own process stood still; pings may be waiting unread."""


@dataclass(frozen=True, slots=True)
class AnswerMade:
    """The answer is on its way."""


@dataclass(frozen=True, slots=True)
class AnswerFailed:
    """The operator's offer could not be answered."""

    code: str
    message: str = ""


ChannelMaker = Literal["ours", "original", "unknown"]


@dataclass(frozen=True, slots=True)
class ChannelOpened:
    """A data channel, and who makes such ones: ``ours`` frames its messages, ``original`` made a bare one before any
    other. Further bare ones may belong to either: an operator of ours opens them on a robot that it takes for one."""

    by: ChannelMaker


@dataclass(frozen=True, slots=True)
class ByeReceived:
    """The operator said goodbye, and why."""

    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class CloseRequested:
    """The robot, or somebody through the server, wants the connection closed."""

    code: str
    message: str = ""


Event = (
    AnswerMade | AnswerFailed | TransportChanged | ChannelOpened | HelloReceived | ControlReceived | ByeReceived
    | CloseRequested | Doubted | DeadlinePassed
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class TellConnected:
    """The peer connection is up."""


@dataclass(frozen=True, slots=True)
class TreatAsOurs:
    """Treat the operator as ours, since it said hello: send the catalogue, wait for ``media.watch``."""


@dataclass(frozen=True, slots=True)
class TreatAsOriginal:
    """Treat the operator as an original one, which knows no control channel: show it every camera. Always after
    :class:`TellConnected`."""


@dataclass(frozen=True, slots=True)
class ClosePeer:
    """The end, once. ``say_bye``: the other side is still there to hear it."""

    code: str
    message: str
    say_bye: bool


Effect = TellConnected | TreatAsOurs | TreatAsOriginal | ClosePeer


def is_media_only(sdp: str) -> bool:
    """Whether an offer has lines for pictures or sound and none for data channels, so that it can carry none."""
    kinds = {line[2:].split(" ", 1)[0] for line in sdp.splitlines() if line.startswith("m=")}
    return bool(kinds) and "application" not in kinds


class RobotPeerMachine:
    """The machine. ``now_s`` is any monotonic clock; ``is_media_only``: the offer has no line for data channels."""

    def __init__(self, now_s: float, *, is_media_only: bool = False) -> None:
        self._phase: Phase = "answering"
        self._is_media_only = is_media_only
        self._is_ours = False
        self._has_channel = False
        self.deadline_s: float | None = now_s + TIMEOUTS["answering"][0]
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""

    @property
    def phase(self) -> Phase:
        return self._phase

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order."""
        if self._phase == "closed":
            return []
        match event:
            case AnswerMade():
                if self._phase == "answering":
                    self._enter("connecting", now_s)
                return []
            case AnswerFailed(code, message):
                return self._close(code, message)
            case TransportChanged(state):
                return self._transport(state, now_s)
            case ChannelOpened(by):
                return self._channel(by, now_s)
            case HelloReceived():
                return self._hello(now_s)
            case ControlReceived():
                if self._phase == "open":
                    self.deadline_s = now_s + PEER_LOST_AFTER_S
                return []
            case ByeReceived(code, message):
                return self._close(code, message)
            case CloseRequested(code, message):
                return self._close(code, message, say_bye=self._phase == "open")
            case Doubted(patience_s):
                if self._phase == "open" and self.deadline_s is not None:
                    self.deadline_s = min(self.deadline_s, now_s + patience_s)
                return []
            case DeadlinePassed():
                return self._overdue(now_s)

    def _enter(self, phase: Phase, now_s: float) -> None:
        self._phase = phase
        limit = TIMEOUTS.get(phase)
        self.deadline_s = now_s + limit[0] if limit else None

    def _transport(self, state: str, now_s: float) -> list[Effect]:
        before = self._phase in ("answering", "connecting", "securing")
        if state == "failed":
            code = "dtls.failed" if self._phase == "securing" else "ice.failed" if before else "peer.lost"
            return self._close(code, "")
        if state == "closed":
            return self._close("ice.failed" if before else "peer.closed", "")
        if state == "securing" and self._phase in ("answering", "connecting"):
            self._enter("securing", now_s)
        if state == "connected" and before:
            return self._connected(now_s)
        return []

    def _connected(self, now_s: float) -> list[Effect]:
        if self._is_media_only:
            return [TellConnected(), *self._original()]
        self._phase = "greeting"
        is_bare = self._has_channel and not self._is_ours
        self.deadline_s = now_s + (HELLO_TIMEOUT_S if is_bare else CHANNEL_TIMEOUT_S)
        return [TellConnected()]

    def _channel(self, by: ChannelMaker, now_s: float) -> list[Effect]:
        is_first, self._has_channel = not self._has_channel, True
        was_ours, self._is_ours = self._is_ours, self._is_ours or by == "ours"
        if by == "original" and not self._is_ours:
            return self._known_as_original()
        if self._phase != "greeting":
            return []
        if self._is_ours and not was_ours:
            self.deadline_s = now_s + CHANNEL_TIMEOUT_S
        elif is_first:
            self.deadline_s = now_s + HELLO_TIMEOUT_S
        return []

    def _known_as_original(self) -> list[Effect]:
        match self._phase:
            case "greeting":
                return self._original()
            case "answering" | "connecting" | "securing":  # what opened a channel is connected, whoever is told first
                return [TellConnected(), *self._original()]
            case _:
                return []

    def _original(self) -> list[Effect]:
        self._phase, self.deadline_s = "original", None
        return [TreatAsOriginal()]

    def _hello(self, now_s: float) -> list[Effect]:
        if self._phase == "open":
            self.deadline_s = now_s + PEER_LOST_AFTER_S
            return []
        was_connected = self._phase in ("greeting", "original")
        self._phase, self.deadline_s = "open", now_s + PEER_LOST_AFTER_S
        # a message can overtake the event that says "connected": what is heard is there
        return [TreatAsOurs()] if was_connected else [TellConnected(), TreatAsOurs()]

    def _overdue(self, now_s: float) -> list[Effect]:
        if self.deadline_s is None or now_s < self.deadline_s:
            return []
        late_s = now_s - self.deadline_s
        if self._phase == "greeting" and self._has_channel and not self._is_ours:
            return self._original()
        if self._phase == "greeting":
            return self._close("channel.timeout", "")
        if self._phase == "open":
            if late_s > STALL_S:
                self.deadline_s = now_s + STALL_S
                return []
            return self._close("peer.lost", "nothing was heard from the operator")
        return self._close(TIMEOUTS[self._phase][1], "")

    def _close(self, code: str, message: str, *, say_bye: bool = False) -> list[Effect]:
        self._phase, self.deadline_s = "closed", None
        return [ClosePeer(code, message, say_bye)]
