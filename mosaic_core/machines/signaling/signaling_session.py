"""Decides what robot and operator decide alike about their socket to a server: how long each wait may take, when to try
again, and what of it a person should hear.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from mosaic_core.machines.signaling import signaling_events as events
from mosaic_core.machines.signaling.signaling_events import ChangeState, CloseSocket, ReconnectAfter, Report, SendSignal
from mosaic_core.machines.timing.backoff import Backoff
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CLOSE_REASONS, RESULT_REASONS, CloseCode, ResultCode, reason

GREETING_TIMEOUT_S = 10.0
"""From the open socket to a usable session."""
SILENCE_TIMEOUT_S = 15.0
"""Our server pings every 5 s; three missed pings are a dead socket that TCP has not noticed yet."""

SocketEvent = (
    events.SocketOpened | events.ConnectFailed | events.FrameReceived | events.SocketClosed | events.NetworkChanged
    | events.DeadlinePassed
)  # fmt: skip
SocketEffect = SendSignal | CloseSocket | ReconnectAfter | ChangeState | Report


class SignalingSession(ABC):
    """Keeps the state of one socket after the other. ``draw`` gives random numbers of [0, 1), ``now_s`` is any
    monotonic clock."""

    def __init__(self, draw: Callable[[], float]) -> None:
        self.state = "offline"
        """``offline``, ``greeting``, ``authorizing``, ``welcoming``, ``ready`` or ``stopped``."""
        self.agreed: dict[str, int] = {}
        """The extensions of the current session."""
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""
        self._welcome: wire.SessionWelcome | None = None
        self._draw = draw
        self._backoff = Backoff()
        self._ready_at_s: float | None = None
        self._refusal = ""
        self._reported = ""

    def handle(self, event: Any, now_s: float) -> Sequence[Any]:
        """What to do now, in order."""
        if self.state == "stopped":
            return []
        match event:
            case events.SocketOpened():
                return self._opened(now_s)
            case events.ConnectFailed(message, code):
                return self._lost(code, message, now_s)
            case events.FrameReceived(text):
                return self._frame(text, now_s)
            case events.SocketClosed(code):
                return [] if self.state == "offline" else self._closed(code, now_s)
            case events.NetworkChanged():
                return self._moved()
            case events.DeadlinePassed():
                return self._overdue(now_s)
            case _:
                return self._own(event)

    @abstractmethod
    def _own(self, event: Any) -> Sequence[Any]:
        """What only this side is told."""

    @abstractmethod
    def _frame(self, text: str, now_s: float) -> Sequence[Any]: ...

    @abstractmethod
    def _closed(self, close_code: int | None, now_s: float) -> Sequence[Any]: ...

    @abstractmethod
    def _credentials(self) -> wire.Authorize:
        """Who we are, with the extensions that are :attr:`agreed`."""

    @abstractmethod
    def _ready(self, now_s: float) -> Sequence[Any]:
        """The session can be used."""

    def _opened(self, now_s: float) -> Sequence[SocketEffect]:
        self.state, self.agreed, self._welcome, self._refusal = "greeting", {}, None, ""
        self.deadline_s = now_s + GREETING_TIMEOUT_S
        return [ChangeState("connecting")]

    def _read(self, text: str, now_s: float) -> wire.SignalingMessage:
        """A frame, which shows that the server is there; raises :class:`WireError`."""
        if self.state == "ready" and self.agreed:
            self.deadline_s = now_s + SILENCE_TIMEOUT_S
        return wire.parse_signaling(text)

    def _before_session(self, message: wire.SignalingMessage, now_s: float) -> Sequence[Any]:
        """Who we are is asked, and judged."""
        match message:
            case wire.PingPing():
                return [SendSignal(wire.PingPong(ping_id=message.ping_id))]
            case wire.AuthorizeRequest():  # an original server may ask again
                self.state, self.agreed = "authorizing", wire.agreed_extensions(message.extensions)
                return [SendSignal(self._credentials())]
            case wire.AuthorizeResult() if self.state == "authorizing":
                return self._authorized(message.code, now_s)
            case wire.ErrorEcho() if self.state == "authorizing" and message.request_type.startswith("authorize"):
                return self._authorized(message.code, now_s)
            case wire.SessionWelcome() if self.state == "welcoming":
                self._welcome = message
                self.agreed = wire.agreed_extensions(message.extensions, self.agreed)
                return self._ready(now_s)
            case _:
                return []

    def _authorized(self, code: int, now_s: float) -> Sequence[Any]:
        if code != ResultCode.SUCCESS:
            known = RESULT_REASONS.get(code, "")
            self._refusal = known if known.startswith("auth.") else "auth.failed"
            return [CloseSocket(1000, self._refusal)]
        if self.agreed:
            self.state = "welcoming"
            return []
        return self._ready(now_s)

    def _became_ready(self, now_s: float) -> None:
        self.state, self._ready_at_s = "ready", now_s
        self.deadline_s = now_s + SILENCE_TIMEOUT_S if self.agreed else None

    def _overdue(self, now_s: float) -> Sequence[SocketEffect]:
        if self.deadline_s is None or now_s < self.deadline_s:
            return []
        self.deadline_s = None
        return [CloseSocket(CloseCode.TIMEOUT, "signal.timeout")]

    def _moved(self) -> Sequence[SocketEffect]:
        """Nothing failed: no back-off, and nothing to report."""
        was_up = self.state != "offline"
        self.state, self.deadline_s, self._ready_at_s = "offline", None, None
        self._backoff.reset()
        return [*([ChangeState("offline")] if was_up else []), ReconnectAfter(0.0)]

    def _backoff_for(self, code: str) -> Backoff:
        return self._backoff

    def _lost(self, code: str, message: str, now_s: float) -> Sequence[SocketEffect]:
        """The same cause is reported once, until the server is there again."""
        ready_for_s = 0.0 if self._ready_at_s is None else now_s - self._ready_at_s
        self.state, self.deadline_s, self._ready_at_s = "offline", None, None
        effects: list[SocketEffect] = [ChangeState("offline")]
        if code != self._reported:
            self._reported = code
            effects.append(Report(code, message))
        return [*effects, ReconnectAfter(self._backoff_for(code).failed(ready_for_s, self._draw()))]

    def _lost_by(self, close_code: int | None, now_s: float) -> Sequence[SocketEffect]:
        """The socket was closed, and not because of who we are."""
        known = CLOSE_REASONS.get(close_code or 0, "")
        message = reason(known).sentence if known else f"The server closed the connection (code {close_code})."
        return self._lost(known or "signal.unreachable", message, now_s)

    def _stopped(self, code: str) -> Sequence[SocketEffect]:
        """For good."""
        self.state, self.deadline_s = "stopped", None
        return [ChangeState("stopped"), Report(code, reason(code).sentence)]
