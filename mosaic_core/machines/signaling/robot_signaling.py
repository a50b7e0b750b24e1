"""The robot's side of the signaling socket, as a machine: events in, effects out; the driver only carries them out.

::

    offline ──opened──► greeting ──authorize.req──► authorizing ──100──► (welcoming) ──► ready ──closed──► offline
       └────────────── every wait is bounded; closed with 4409 ends in `stopped` ──────────────┘

Toward an original server exactly its own keys are sent, one peer at a time. With ours, what both sides agreed on.
"""

from __future__ import annotations

from mosaic_core.machines.signaling.peer_admission import PeerAdmission, PeerIdentity, RefusePeer, StopPeer
from mosaic_core.machines.signaling.signaling_events import (
    ChangeState,
    CloseSocket,
    ConnectFailed,
    DeadlinePassed,
    Effect,
    Event,
    FrameReceived,
    MessageReady,
    NetworkChanged,
    PeerConnected,
    PeerEnded,
    ReconnectAfter,
    Report,
    RobotFacts,
    SendSignal,
    ShutdownBegun,
    SocketClosed,
    SocketOpened,
    VerifyTicket,
)
from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CLOSE_REASONS, RESULT_REASONS, CloseCode, ResultCode, reason
from mosaic_core.words.errors import WireError

GREETING_TIMEOUT_S = 10.0
"""From the open socket to a usable session."""
SILENCE_TIMEOUT_S = 15.0
"""Our server pings every 5 s; three missed pings are a dead socket that TCP has not noticed yet."""
REFUSED_POLICY = BackoffPolicy(first_s=30.0, max_s=300.0)
"""Wrong credentials rarely become right by themselves; a token made anew on the server should still be picked up."""


class RobotSignaling:
    """The machine. ``now_s`` is any monotonic clock, ``random_unit`` a random number of [0, 1)."""

    def __init__(self, facts: RobotFacts, verify_ticket: VerifyTicket) -> None:
        self._facts = facts
        self._verify_ticket = verify_ticket
        self._state = "offline"
        self._agreed: dict[str, int] = {}
        self._welcome: wire.SessionWelcome | None = None
        self._admission = PeerAdmission(facts.max_peers)
        self._backoff = Backoff()
        self._refused_backoff = Backoff(REFUSED_POLICY)
        self._ready_at_s: float | None = None
        self._reported = ""
        self._refusal = ""
        self._grumbled: set[str] = set()
        self._status: wire.RobotStatus | None = None
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""

    @property
    def state(self) -> str:
        """``offline``, ``greeting``, ``authorizing``, ``welcoming``, ``ready`` or ``stopped``."""
        return self._state

    @property
    def agreed(self) -> dict[str, int]:
        """The extensions of the current session."""
        return dict(self._agreed)

    def handle(self, event: Event, now_s: float, random_unit: float = 0.0) -> list[Effect]:
        """What to do now, in order."""
        if self._state == "stopped":
            return []
        match event:
            case SocketOpened():
                return self._opened(now_s)
            case ConnectFailed(message, code):
                return self._lost(code, message, 0.0, random_unit)
            case FrameReceived(text):
                return self._frame(text, now_s)
            case SocketClosed(code):
                return self._closed(code, now_s, random_unit)
            case NetworkChanged():
                return self._moved()
            case DeadlinePassed():
                return self._overdue(now_s)
            case MessageReady(message):
                return [SendSignal(message)] if self._state == "ready" else []
            case PeerConnected(peer_id):
                self._admission.connected(peer_id)
                return self._status_effects()
            case PeerEnded():
                return self._peer_ended(event)
            case ShutdownBegun():
                return self._shutdown()

    # -- the socket ----------------------------------------------------------------------------------------------

    def _opened(self, now_s: float) -> list[Effect]:
        self._state = "greeting"
        self._agreed, self._welcome, self._refusal, self._status = {}, None, "", None
        self._grumbled.clear()
        self.deadline_s = now_s + GREETING_TIMEOUT_S
        return [ChangeState("connecting")]

    def _closed(self, code: int | None, now_s: float, random_unit: float) -> list[Effect]:
        if self._state == "offline":
            return []
        ready_for_s = now_s - self._ready_at_s if self._ready_at_s is not None else 0.0
        if code == CloseCode.REPLACED:
            self._state, self.deadline_s = "stopped", None
            return [ChangeState("stopped"), Report("signal.replaced", reason("signal.replaced").sentence)]
        if code == CloseCode.AUTH:
            self._refusal = self._refusal or "auth.failed"
        if self._refusal:
            return self._lost(self._refusal, reason(self._refusal).sentence, ready_for_s, random_unit)
        known = CLOSE_REASONS.get(CloseCode(code), "") if code in list(CloseCode) else ""
        cause = reason(known).sentence if known else f"The server closed the connection (code {code})."
        return self._lost(known or "signal.unreachable", cause, ready_for_s, random_unit)

    def _lost(self, code: str, message: str, ready_for_s: float, random_unit: float) -> list[Effect]:
        self._state, self.deadline_s, self._ready_at_s = "offline", None, None
        backoff = self._refused_backoff if code.startswith("auth.") else self._backoff
        effects: list[Effect] = [ChangeState("offline")]
        if code != self._reported:
            self._reported = code
            effects.append(Report(code, message))
        return [*effects, ReconnectAfter(backoff.failed(ready_for_s, random_unit))]

    def _moved(self) -> list[Effect]:
        """Nothing failed: no back-off, and nothing to report."""
        was_up = self._state != "offline"
        self._state, self.deadline_s, self._ready_at_s = "offline", None, None
        self._backoff.reset()
        return [*([ChangeState("offline")] if was_up else []), ReconnectAfter(0.0)]

    def _overdue(self, now_s: float) -> list[Effect]:
        if self.deadline_s is None or now_s < self.deadline_s:
            return []
        self.deadline_s = None
        return [CloseSocket(CloseCode.TIMEOUT, "signal.timeout")]

    def _shutdown(self) -> list[Effect]:
        was_ready = self._state == "ready"
        self._state, self.deadline_s = "stopped", None
        effects: list[Effect] = [ChangeState("stopped")]
        if was_ready:
            effects.append(SendSignal(wire.StatusUpdate(status=wire.RobotStatus.DISCONNECTED)))
        return [*effects, CloseSocket()]

    # -- frames --------------------------------------------------------------------------------------------------

    def _frame(self, text: str, now_s: float) -> list[Effect]:
        if self._state == "offline":
            return []
        if self._state == "ready" and self._agreed:
            self.deadline_s = now_s + SILENCE_TIMEOUT_S
        try:
            message = wire.parse_signaling(text)
        except WireError as error:
            return self._grumble(f"the server sent something unreadable: {error.message}")
        if self._state == "ready":
            return self._in_session(message, now_s)
        return self._before_session(message, now_s)

    def _before_session(self, message: wire.SignalingMessage, now_s: float) -> list[Effect]:
        match message:
            case wire.AuthorizeRequest():
                return self._authorize(message.extensions)
            case wire.AuthorizeResult() if self._state == "authorizing":
                return self._authorized(message.code, now_s)
            case wire.ErrorEcho() if message.request_type.startswith("authorize"):
                return self._authorized(message.code, now_s)
            case wire.SessionWelcome() if self._state == "welcoming":
                self._welcome = message
                self._agreed = wire.agreed_extensions(message.extensions, self._agreed)
                return self._ready(now_s)
            case wire.PingPing():
                return [SendSignal(wire.PingPong(ping_id=message.ping_id))]
            case _:
                return []

    def _authorize(self, offered: dict[str, int] | None) -> list[Effect]:
        self._state = "authorizing"
        self._agreed = wire.agreed_extensions(offered)
        answer = wire.Authorize(
            robot_id=self._facts.robot_id, data=self._facts.token, extensions=self._agreed if self._agreed else None
        )
        return [SendSignal(answer)]

    def _authorized(self, code: int, now_s: float) -> list[Effect]:
        if code != ResultCode.SUCCESS:
            known = code in list(ResultCode)
            self._refusal = RESULT_REASONS.get(ResultCode(code), "auth.failed") if known else "auth.failed"
            if not self._refusal.startswith("auth."):
                self._refusal = "auth.failed"
            return [CloseSocket(1000, self._refusal)]
        if self._agreed:
            self._state = "welcoming"
            return []
        return self._ready(now_s)

    def _ready(self, now_s: float) -> list[Effect]:
        self._state, self._ready_at_s = "ready", now_s
        self.deadline_s = now_s + SILENCE_TIMEOUT_S if self._agreed else None
        self._refused_backoff.reset()
        effects: list[Effect] = [ChangeState("ready")]
        if self._reported:
            self._reported = ""
            effects.append(Report("", "The server is there again."))
        if "catalogue" in self._agreed:  # before the status: whoever sees it ready may connect at once
            effects.append(SendSignal(wire.CatalogueAnnounce(catalogue=self._facts.catalogue.short())))
        return effects + self._status_effects()

    def _in_session(self, message: wire.SignalingMessage, now_s: float) -> list[Effect]:
        match message:
            case wire.PingPing():
                return [SendSignal(wire.PingPong(ping_id=message.ping_id))]
            case wire.PrepareConnection():
                self._admission.prepare(message, now_s)
                return []
            case wire.SdpOffer():
                return self._offer(message, now_s)
            case wire.ExchangeIceCandidate():
                return list(self._admission.candidate(message, now_s))
            case wire.ClosePeerConnection():
                return self._close_peer(message)
            case wire.ErrorEcho():
                return self._grumble(f"the server refused {message.request_type}: {message.code}")
            case _:
                return []

    def _grumble(self, message: str) -> list[Effect]:
        """Each complaint once per connection: a broken server must not fill the log."""
        if message in self._grumbled or len(self._grumbled) >= 20:
            return []
        self._grumbled.add(message)
        return [Report("signal.bad_message", message)]

    # -- peers ---------------------------------------------------------------------------------------------------

    @property
    def _takes_several(self) -> bool:
        return "multiPeer" in self._agreed

    def _offer(self, offer: wire.SdpOffer, now_s: float) -> list[Effect]:
        peer_id = offer.rtc_connection_id
        decision = self._admission.decide(
            offer,
            now_s,
            tickets=self._verify if "tickets" in self._agreed else None,
            several=self._takes_several,
            configured=self._facts.ice_servers,
            welcomed=self._welcome.ice_servers if self._welcome else (),
        )
        effects: list[Effect] = []
        for effect in decision:
            if isinstance(effect, RefusePeer) and not effect.is_live:
                effects += self._told(peer_id, effect.code, effect.message)
            if isinstance(effect, StopPeer):
                effects += [effect, *self._farewell(effect)]
            else:
                effects.append(effect)
                effects += self._status_effects()
        return effects

    def _verify(self, ticket: str, prepared: wire.PrepareConnection) -> PeerIdentity:
        return self._verify_ticket(ticket, prepared, self._welcome.keys if self._welcome else ())

    def _close_peer(self, message: wire.ClosePeerConnection) -> list[Effect]:
        phase = self._admission.forget(message.rtc_connection_id)
        if phase is None:
            return []
        stop = StopPeer(message.rtc_connection_id, message.code or "peer.closed", was_connected=phase == "connected")
        return [stop, *self._farewell(stop)]

    def _peer_ended(self, event: PeerEnded) -> list[Effect]:
        phase = self._admission.forget(event.peer_id)
        if phase is None:
            return []
        gone = StopPeer(event.peer_id, event.code, was_connected=phase == "connected")
        return [*self._told(event.peer_id, event.code, event.message), *self._farewell(gone)]

    def _told(self, peer_id: str, code: str, message: str) -> list[Effect]:
        """Our operators learn why; one that closed the connection itself knows."""
        if self._state != "ready" or "closeReasons" not in self._agreed or code == "peer.closed":
            return []
        return [SendSignal(wire.ClosePeerConnection(rtc_connection_id=peer_id, code=code, message=message or None))]

    def _farewell(self, stop: StopPeer) -> list[Effect]:
        """The original sequence says 3 before 0 when a connected peer ends."""
        if self._state != "ready":
            return []
        effects: list[Effect] = []
        if not self._takes_several and stop.was_connected:
            effects.append(SendSignal(wire.StatusUpdate(status=wire.RobotStatus.RTC_DISCONNECTING)))
            self._status = wire.RobotStatus.RTC_DISCONNECTING
        return effects + self._status_effects()

    def _status_effects(self) -> list[Effect]:
        """Tell the status where it has changed: capacity toward our server, the one peer toward an original."""
        if self._state != "ready":
            return []
        status = self._admission.status(several=self._takes_several)
        if status == self._status:
            return []
        self._status = status
        return [SendSignal(wire.StatusUpdate(status=status))]
