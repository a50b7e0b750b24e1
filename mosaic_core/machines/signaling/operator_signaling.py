"""The operator's side of the signaling socket, as a machine.

::

    offline ──opened──► greeting ──authorize.req──► authorizing ──100──► (welcoming) ──► ready ──closed──► offline
                                                         └── refused ──► stopped

A refused token stops it: nothing but a new log-in helps. Everything else is tried again with back-off.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from mosaic_core.machines.signaling.signaling_events import (
    ChangeState,
    CloseSocket,
    ConnectFailed,
    DeadlinePassed,
    FrameReceived,
    NetworkChanged,
    ReconnectAfter,
    Report,
    SendSignal,
    SocketClosed,
    SocketOpened,
)
from mosaic_core.machines.timing.backoff import Backoff
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CLOSE_REASONS, RESULT_REASONS, CloseCode, ResultCode, reason
from mosaic_core.words.errors import WireError

GREETING_TIMEOUT_S = 10.0
SILENCE_TIMEOUT_S = 15.0
"""Our server pings every 5 s."""


@dataclass(frozen=True, slots=True)
class Deliver:
    """A message for the rest of the operator."""

    message: wire.SignalingMessage


Event = SocketOpened | ConnectFailed | FrameReceived | SocketClosed | NetworkChanged | DeadlinePassed
Effect = SendSignal | CloseSocket | ReconnectAfter | ChangeState | Report | Deliver


class OperatorSignaling:
    """``now_s`` is any monotonic clock, ``random_unit`` a random number of [0, 1)."""

    def __init__(self, access_token: str) -> None:
        self._access_token = access_token
        self._robot_ids: tuple[str, ...] = ()
        self._backoff = Backoff()
        self._ready_at_s: float | None = None
        self._refusal = ""
        self._reported = ""
        self.state = "offline"
        self.agreed: dict[str, int] = {}
        self.welcome: wire.SessionWelcome | None = None
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""

    def subscribe(self, robot_ids: Iterable[str]) -> list[Effect]:
        """Hear of these robots, now and after every reconnection."""
        self._robot_ids = tuple(dict.fromkeys(robot_ids))
        return self._subscription() if self.state == "ready" else []

    def probe(self) -> list[Effect]:
        """Ask for what is answered at once, to see whether the server is still there."""
        return self._subscription()

    def handle(self, event: Event, now_s: float, random_unit: float = 0.0) -> list[Effect]:
        """What to do now, in order."""
        if self.state == "stopped":
            return []
        match event:
            case SocketOpened():
                self.state, self.agreed, self.welcome, self._refusal = "greeting", {}, None, ""
                self.deadline_s = now_s + GREETING_TIMEOUT_S
                return [ChangeState("connecting")]
            case ConnectFailed(message, code):
                return self._lost(code, message, now_s, random_unit)
            case FrameReceived(text):
                return self._frame(text, now_s)
            case SocketClosed(code):
                return self._closed(code, now_s, random_unit)
            case NetworkChanged():
                return self._moved()
            case DeadlinePassed():
                if self.deadline_s is None or now_s < self.deadline_s:
                    return []
                self.deadline_s = None
                return [CloseSocket(CloseCode.TIMEOUT, "signal.timeout")]

    def _closed(self, close_code: int | None, now_s: float, random_unit: float) -> list[Effect]:
        if self.state == "offline":
            return []
        if close_code in (CloseCode.AUTH, CloseCode.FORBIDDEN) and not self._refusal:
            self._refusal = CLOSE_REASONS[CloseCode(close_code)]
        if self._refusal:
            return self._stopped(self._refusal)
        code = CLOSE_REASONS.get(CloseCode(close_code), "") if close_code in list(CloseCode) else ""
        message = reason(code).sentence if code else f"The server closed the connection (code {close_code})."
        return self._lost(code or "signal.unreachable", message, now_s, random_unit)

    def _moved(self) -> list[Effect]:
        """Nothing failed: no back-off, and nothing to report."""
        was_up = self.state != "offline"
        self.state, self.deadline_s, self._ready_at_s = "offline", None, None
        self._backoff.reset()
        return [*([ChangeState("offline")] if was_up else []), ReconnectAfter(0.0)]

    def _stopped(self, code: str) -> list[Effect]:
        self.state, self.deadline_s = "stopped", None
        return [ChangeState("stopped"), Report(code, reason(code).sentence)]

    def _lost(self, code: str, message: str, now_s: float, random_unit: float) -> list[Effect]:
        ready_for_s = 0.0 if self._ready_at_s is None else now_s - self._ready_at_s
        self.state, self.deadline_s, self._ready_at_s = "offline", None, None
        effects: list[Effect] = [ChangeState("offline")]
        if code != self._reported:
            self._reported = code
            effects.append(Report(code, message))
        return [*effects, ReconnectAfter(self._backoff.failed(ready_for_s, random_unit))]

    def _frame(self, text: str, now_s: float) -> list[Effect]:
        if self.state == "ready" and self.agreed:
            self.deadline_s = now_s + SILENCE_TIMEOUT_S
        try:
            message = wire.parse_signaling(text)
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
                self.welcome = message
                self.agreed = wire.agreed_extensions(message.extensions, self.agreed)
                return self._ready(now_s)
            case _:
                return [Deliver(message)] if self.state == "ready" else []

    def _authorized(self, code: int, now_s: float) -> list[Effect]:
        if code != ResultCode.SUCCESS:
            known = RESULT_REASONS.get(ResultCode(code), "") if code in list(ResultCode) else ""
            self._refusal = known if known.startswith("auth.") else "auth.failed"
            return [*self._stopped(self._refusal), CloseSocket(1000, self._refusal)]
        if self.agreed:
            self.state = "welcoming"
            return []
        return self._ready(now_s)

    def _ready(self, now_s: float) -> list[Effect]:
        self.state, self._ready_at_s, self._reported = "ready", now_s, ""
        self.deadline_s = now_s + SILENCE_TIMEOUT_S if self.agreed else None
        return [ChangeState("ready"), *self._subscription()]

    def _subscription(self) -> list[Effect]:
        return [SendSignal(wire.StatusSubscribe(robot_ids=self._robot_ids))] if self._robot_ids else []
