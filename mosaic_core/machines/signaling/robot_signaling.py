"""The robot's side of the signaling socket, as a machine: events in, effects out; the driver only carries them out.

::

    offline ──opened──► greeting ──authorize.req──► authorizing ──100──► (welcoming) ──► ready ──closed──► offline
       └────────────── every wait is bounded; closed with 4409 ends in `stopped` ──────────────┘

Toward an original server exactly its own keys are sent, one peer at a time. With ours, what both sides agreed on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from mosaic_core.machines.signaling.peer_admission import PeerAdmission, PeerIdentity, RefusePeer, StopPeer
from mosaic_core.machines.signaling.signaling_events import (
    CatalogueChanged,
    ChangeState,
    CloseSocket,
    Effect,
    MessageReady,
    PeerConnected,
    PeerEnded,
    Report,
    RobotFacts,
    SendSignal,
    ShutdownBegun,
    VerifyTicket,
)
from mosaic_core.machines.signaling.signaling_session import SignalingSession, SocketEffect
from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CloseCode, reason
from mosaic_core.words.errors import WireError

REFUSED_POLICY = BackoffPolicy(first_s=30.0, max_s=300.0)
"""Wrong credentials rarely become right by themselves; a token made anew on the server should still be picked up."""
TRIES_AGAIN = "The robot tries again by itself, at intervals of up to five minutes."


class RobotSignaling(SignalingSession):
    """Decides for a robot: authorizes, admits operators, tells its status, and goes on trying whatever happens."""

    def __init__(self, facts: RobotFacts, verify_ticket: VerifyTicket, draw: Callable[[], float]) -> None:
        super().__init__(draw)
        self._facts = facts
        self._verify_ticket = verify_ticket
        self._admission = PeerAdmission(facts.max_peers)
        self._refused_backoff = Backoff(REFUSED_POLICY)
        self._grumbled: set[str] = set()
        self._status: wire.RobotStatus | None = None

    def _own(
        self, event: MessageReady | PeerConnected | PeerEnded | CatalogueChanged | ShutdownBegun
    ) -> Sequence[Effect]:
        match event:
            case MessageReady(message):
                return [SendSignal(message)] if self.state == "ready" else []
            case PeerConnected(peer_id):
                self._admission.connected(peer_id)
                return self._status_effects()
            case PeerEnded():
                return self._peer_ended(event)
            case CatalogueChanged(catalogue):
                self._facts = replace(self._facts, catalogue=catalogue)
                return self._announcement() if self.state == "ready" else []
            case ShutdownBegun():
                return self._shutdown()

    # -- the socket ----------------------------------------------------------------------------------------------

    def _opened(self, now_s: float) -> Sequence[SocketEffect]:
        self._status = None
        self._grumbled.clear()
        return super()._opened(now_s)

    def _closed(self, close_code: int | None, now_s: float) -> Sequence[Effect]:
        if close_code == CloseCode.REPLACED:
            return self._stopped("signal.replaced")
        if close_code == CloseCode.AUTH:
            self._refusal = self._refusal or "auth.failed"
        if self._refusal:
            message = f"{reason(self._refusal).sentence} {TRIES_AGAIN}"
            return self._lost(self._refusal, message, now_s)
        return self._lost_by(close_code, now_s)

    def _backoff_for(self, code: str) -> Backoff:
        return self._refused_backoff if code.startswith("auth.") else self._backoff

    def _shutdown(self) -> Sequence[Effect]:
        was_ready = self.state == "ready"
        self.state, self.deadline_s = "stopped", None
        effects: list[Effect] = [ChangeState("stopped")]
        if was_ready:
            effects.append(SendSignal(wire.StatusUpdate(status=wire.RobotStatus.DISCONNECTED)))
        return [*effects, CloseSocket()]

    # -- frames --------------------------------------------------------------------------------------------------

    def _frame(self, text: str, now_s: float) -> Sequence[Effect]:
        if self.state == "offline":
            return []
        try:
            message = self._read(text, now_s)
        except WireError as error:
            return self._grumble(f"the server sent something unreadable: {error.message}")
        if self.state == "ready":
            return self._in_session(message, now_s)
        return self._before_session(message, now_s)

    def _credentials(self) -> wire.Authorize:
        facts = self._facts
        return wire.Authorize(robot_id=facts.robot_id, data=facts.token, extensions=self.agreed or None)

    def _ready(self, now_s: float) -> Sequence[Effect]:
        self._became_ready(now_s)
        self._refused_backoff.reset()
        effects: list[Effect] = [ChangeState("ready")]
        if self._reported:
            self._reported = ""
            effects.append(Report("", "The server is there again."))
        effects += self._announcement()  # before the status: whoever sees it ready may connect at once
        return [*effects, *self._status_effects()]

    def _announcement(self) -> list[Effect]:
        if "catalogue" not in self.agreed:
            return []
        return [SendSignal(wire.CatalogueAnnounce(catalogue=self._facts.catalogue.short()))]

    def _in_session(self, message: wire.SignalingMessage, now_s: float) -> Sequence[Effect]:
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

    def _grumble(self, message: str) -> Sequence[Effect]:
        """Each complaint once per connection: a broken server must not fill the log."""
        if message in self._grumbled or len(self._grumbled) >= 20:
            return []
        self._grumbled.add(message)
        return [Report("signal.bad_message", message)]

    # -- peers ---------------------------------------------------------------------------------------------------

    @property
    def _takes_several(self) -> bool:
        return "multiPeer" in self.agreed

    def _offer(self, offer: wire.SdpOffer, now_s: float) -> Sequence[Effect]:
        peer_id = offer.rtc_connection_id
        decision = self._admission.decide(
            offer,
            now_s,
            tickets=self._verify if "tickets" in self.agreed else None,
            several=self._takes_several,
            configured=self._facts.ice_servers,
            welcomed=self._welcome.ice_servers if self._welcome else (),
        )
        effects: list[Effect] = []
        for effect in decision:
            if isinstance(effect, RefusePeer) and not effect.is_live:
                effects += self._told(peer_id, effect.code, effect.message)
            if isinstance(effect, StopPeer):
                effects += [effect, *self._told(effect.peer_id, effect.code, ""), *self._farewell(effect)]
            else:
                effects.append(effect)
                effects += self._status_effects()
        return effects

    def _verify(self, ticket: str, prepared: wire.PrepareConnection) -> PeerIdentity:
        return self._verify_ticket(ticket, prepared, self._welcome.keys if self._welcome else ())

    def _close_peer(self, message: wire.ClosePeerConnection) -> Sequence[Effect]:
        phase = self._admission.forget(message.rtc_connection_id)
        if phase is None:
            return []
        stop = StopPeer(message.rtc_connection_id, message.code or "peer.closed", was_connected=phase == "connected")
        return [stop, *self._farewell(stop)]

    def _peer_ended(self, event: PeerEnded) -> Sequence[Effect]:
        phase = self._admission.forget(event.peer_id)
        if phase is None:
            return []
        gone = StopPeer(event.peer_id, event.code, was_connected=phase == "connected")
        return [*self._told(event.peer_id, event.code, event.message), *self._farewell(gone)]

    def _told(self, peer_id: str, code: str, message: str) -> Sequence[Effect]:
        """Our operators learn why; one that closed the connection itself knows."""
        if self.state != "ready" or "closeReasons" not in self.agreed or code == "peer.closed":
            return []
        return [SendSignal(wire.ClosePeerConnection(rtc_connection_id=peer_id, code=code, message=message or None))]

    def _farewell(self, stop: StopPeer) -> Sequence[Effect]:
        """The original sequence says 3 before 0 when a connected peer ends."""
        if self.state != "ready":
            return []
        effects: list[Effect] = []
        if not self._takes_several and stop.was_connected:
            effects.append(SendSignal(wire.StatusUpdate(status=wire.RobotStatus.RTC_DISCONNECTING)))
            self._status = wire.RobotStatus.RTC_DISCONNECTING
        return [*effects, *self._status_effects()]

    def _status_effects(self) -> Sequence[Effect]:
        """Tell the status where it has changed: capacity toward our server, the one peer toward an original."""
        if self.state != "ready":
            return []
        status = self._admission.status(several=self._takes_several)
        if status == self._status:
            return []
        self._status = status
        return [SendSignal(wire.StatusUpdate(status=status))]
