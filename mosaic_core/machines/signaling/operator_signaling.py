"""The operator's side of the signaling socket, as a machine.

::

    offline ──opened──► greeting ──authorize.req──► authorizing ──100──► (welcoming) ──► ready ──closed──► offline
                                                         └── refused ──► stopped

A refused token stops it: nothing but a new log-in helps. Everything else is tried again with back-off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mosaic_core.machines.signaling.signaling_events import (
    ChangeState,
    CloseSocket,
    ConnectFailed,
    DeadlinePassed,
    FrameReceived,
    NetworkChanged,
    SendSignal,
    SocketClosed,
    SocketOpened,
)
from mosaic_core.machines.signaling.signaling_session import SignalingSession, SocketEffect, refusal_code
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CLOSE_REASONS, CloseCode, ResultCode
from mosaic_core.words.errors import WireError


@dataclass(frozen=True, slots=True)
class Deliver:
    """A message for the rest of the operator."""

    message: wire.SignalingMessage


@dataclass(frozen=True, slots=True)
class RobotsWatched:
    """Hear of these robots, now and after every reconnection."""

    robot_ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ServerDoubted:
    """Ask for what is answered at once, to see whether the server is still there."""


Event = (
    SocketOpened | ConnectFailed | FrameReceived | SocketClosed | NetworkChanged | RobotsWatched | ServerDoubted
    | DeadlinePassed
)  # fmt: skip
Effect = SocketEffect | Deliver


class OperatorSignaling(SignalingSession):
    """Decides for an operator: subscribes to robots, and stops for good where its token is refused."""

    def __init__(self, access_token: str, draw: Callable[[], float]) -> None:
        super().__init__(draw)
        self._access_token = access_token
        self._robot_ids: tuple[str, ...] = ()

    def handle(self, event: Event, now_s: float) -> Sequence[Effect]:
        """What to do now, in order."""
        if self.state == "stopped":
            return []
        match event:
            case SocketOpened():
                return self._opened(now_s)
            case ConnectFailed(message, code):
                return self._lost(code, message, now_s)
            case FrameReceived(text):
                return self._frame(text, now_s)
            case SocketClosed(code):
                return self._closed(code, now_s)
            case NetworkChanged():
                return self._moved()
            case RobotsWatched(robot_ids):
                self._robot_ids = tuple(dict.fromkeys(robot_ids))
                return self._subscription()
            case ServerDoubted():
                return self._subscription()
            case DeadlinePassed():
                return self._overdue(now_s)

    def _closed(self, close_code: int | None, now_s: float) -> Sequence[Effect]:
        if self.state == "offline":
            return []
        if close_code in (CloseCode.AUTH, CloseCode.FORBIDDEN) and not self._refusal:
            self._refusal = CLOSE_REASONS[CloseCode(close_code)]
        return self._stopped(self._refusal) if self._refusal else self._lost_by(close_code, now_s)

    def _frame(self, text: str, now_s: float) -> Sequence[Effect]:
        try:
            message = self._read(text, now_s)
        except WireError:
            return []  # a server that is newer than us may say what we don't understand
        match message:
            case wire.PingPing():
                return [SendSignal(wire.PingPong(ping_id=message.ping_id))]
            case wire.AuthorizeRequest() if self.state == "greeting":
                self.state, self.agreed = "authorizing", wire.agreed_extensions(message.extensions)
                return [SendSignal(wire.Authorize(access_token=self._access_token, extensions=self.agreed or None))]
            case wire.AuthorizeResult() if self.state == "authorizing":
                return self._authorized(message.code, now_s)
            case wire.ErrorEcho() if self.state == "authorizing" and message.request_type.startswith("authorize"):
                return self._authorized(message.code, now_s)
            case wire.SessionWelcome() if self.state == "welcoming":
                self._welcomed(message)
                return self._ready(now_s)
            case _:
                return [Deliver(message)] if self.state == "ready" else []

    def _authorized(self, code: int, now_s: float) -> Sequence[Effect]:
        if code != ResultCode.SUCCESS:
            self._refusal = refusal_code(code)
            return [*self._stopped(self._refusal), CloseSocket(1000, self._refusal)]
        if self.agreed:
            self.state = "welcoming"
            return []
        return self._ready(now_s)

    def _ready(self, now_s: float) -> Sequence[Effect]:
        self._became_ready(now_s)
        self._reported = ""
        return [ChangeState("ready"), *self._subscription()]

    def _subscription(self) -> Sequence[Effect]:
        if self.state != "ready" or not self._robot_ids:
            return []
        return [SendSignal(wire.StatusSubscribe(robot_ids=self._robot_ids))]
