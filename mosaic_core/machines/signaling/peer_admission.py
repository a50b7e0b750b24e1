"""Which operators a robot takes: matches what the server prepared with the offers that come, checks tickets,
keeps early candidates, and gives places.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from mosaic_core.machines.signaling.robot_places import Comer, NoPlace, RobotPlaces
from mosaic_core.words import signaling as wire
from mosaic_core.words.control import Role
from mosaic_core.words.errors import AuthError
from mosaic_core.words.ice import IceServer

PREPARED_FOR_S = 60.0
"""An offer follows its preparation within a second; after a minute nobody is coming."""
MAX_PREPARED = 64
MAX_CANDIDATES = 64
"""A browser has about ten; more is somebody filling our memory."""


@dataclass(frozen=True, slots=True)
class PeerIdentity:
    """The identity of a peer's operator, as far as known. ``is_program``: its server says that no person signed in
    there."""

    session_id: str
    operator_id: str = ""
    name: str = ""
    role: Role = "operator"
    is_program: bool = False


@dataclass(frozen=True, slots=True)
class StartPeer:
    """Start a peer that answers an operator's offer."""

    peer_id: str
    identity: PeerIdentity
    offer_sdp: str
    tracks: dict[str, str] | None
    ice_servers: tuple[IceServer, ...]
    candidates: tuple[wire.IceCandidate, ...] = ()
    is_local: bool = False
    """The operator asked the server over the loopback of the server's machine."""


@dataclass(frozen=True, slots=True)
class StopPeer:
    """Stop a peer; ``code`` says why."""

    peer_id: str
    code: str
    was_connected: bool = False


@dataclass(frozen=True, slots=True)
class AddCandidate:
    """Give a peer an ICE candidate of its operator."""

    peer_id: str
    candidate: wire.IceCandidate


@dataclass(frozen=True, slots=True)
class RenegotiatePeer:
    """A further offer of a running peer connection."""

    peer_id: str
    offer_sdp: str
    tracks: dict[str, str] | None


@dataclass(frozen=True, slots=True)
class RefusePeer:
    """The operator is not taken; nothing was started. ``is_live``: an earlier connection under this id goes on, so
    nobody is told.
    """

    peer_id: str
    code: str
    message: str = ""
    is_live: bool = False


Ticketed = Callable[[str, wire.PrepareConnection], PeerIdentity]


@dataclass(slots=True)
class _Prepared:
    message: wire.PrepareConnection
    at_s: float
    candidates: list[wire.IceCandidate] = field(default_factory=list)


class PeerAdmission:
    """The robot's list of prepared and running peers. ``now_s`` is any monotonic clock."""

    def __init__(self, max_peers: int) -> None:
        self._prepared: dict[str, _Prepared] = {}
        self._places = RobotPlaces(max_peers)
        self._candidates: Counter[str] = Counter()
        self._identities: dict[str, PeerIdentity] = {}
        self._certificates: dict[str, frozenset[str]] = {}

    def prepare(self, message: wire.PrepareConnection, now_s: float) -> None:
        """The server announces an offer."""
        self._forget_old(now_s)
        if len(self._prepared) >= MAX_PREPARED:
            del self._prepared[next(iter(self._prepared))]
        self._prepared[message.rtc_connection_id] = _Prepared(message, now_s)

    def candidate(self, message: wire.ExchangeIceCandidate, now_s: float) -> Iterator[AddCandidate]:
        """A candidate for a running peer goes on, one before its offer waits, one for nobody is dropped."""
        peer_id = message.rtc_connection_id
        if peer_id in self._places:
            self._candidates[peer_id] += 1
            if self._candidates[peer_id] <= MAX_CANDIDATES:
                yield AddCandidate(peer_id, message.ice_candidate)
            return
        self._forget_old(now_s)
        prepared = self._prepared.get(peer_id)
        if prepared is not None and len(prepared.candidates) < MAX_CANDIDATES:
            prepared.candidates.append(message.ice_candidate)

    def decide(
        self,
        offer: wire.SdpOffer,
        now_s: float,
        *,
        tickets: Ticketed | None,
        several: bool,
        configured: tuple[IceServer, ...] = (),
        welcomed: tuple[IceServer, ...] = (),
    ) -> Iterator[StartPeer | StopPeer | RenegotiatePeer | RefusePeer]:
        """What an offer leads to, step by step. ``tickets`` checks one where the server agreed to send them.

        The robot's own ``configured`` ICE servers always count; of the server's those of the preparation, whose
        credentials are fresh, and only without a preparation those that it was ``welcomed`` with.
        """
        self._forget_old(now_s)
        peer_id = offer.rtc_connection_id
        certificates = fingerprints(offer.sdp_offer)
        if certificates and certificates == self._certificates.get(peer_id):
            self._prepared.pop(peer_id, None)
            yield RenegotiatePeer(peer_id, offer.sdp_offer, offer.tracks)
            return
        if several and peer_id in self._places:
            yield RefusePeer(
                peer_id, "signal.bad_message", "this connection has its offer; a new one needs an id", True
            )
            return
        prepared = self._prepared.pop(peer_id, None)
        try:
            identity = self._identity(peer_id, prepared, tickets)
        except AuthError as error:
            yield RefusePeer(peer_id, error.code, error.message)
            return
        if any(
            identity.session_id == other.session_id and identity.operator_id != other.operator_id
            for other in self._identities.values()
        ):
            # Whoever took over a session would take over what hangs on it.
            yield RefusePeer(peer_id, "peer.not_allowed", "this session belongs to another operator")
            return
        if not several:  # the original robot has one peer, and the newest offer wins (UPSTREAM §3.5)
            yield from self._stopped(self._places.phases, "peer.replaced")
        phases = self._places.phases
        try:
            leavers = self._places.take(Comer(peer_id, identity.operator_id, identity.session_id, identity.role), now_s)
        except NoPlace as error:
            yield RefusePeer(peer_id, error.code, error.message)
            return
        yield from self._stopped({leaver: phases[leaver] for leaver in leavers}, "signal.robot_busy")
        fresh = prepared.message.ice_servers if prepared else None
        servers = (*configured, *(welcomed if fresh is None else fresh))
        self._identities[peer_id] = identity
        self._certificates[peer_id] = certificates
        early = tuple(prepared.candidates) if prepared else ()
        self._candidates[peer_id] = len(early)
        is_local = prepared is not None and prepared.message.is_local is True
        yield StartPeer(peer_id, identity, offer.sdp_offer, offer.tracks, servers, early, is_local)

    def _stopped(self, phases: Mapping[str, str], code: str) -> Iterator[StopPeer]:
        for peer_id, phase in phases.items():
            self.forget(peer_id)
            yield StopPeer(peer_id, code, was_connected=phase == "connected")

    @staticmethod
    def _identity(peer_id: str, prepared: _Prepared | None, tickets: Ticketed | None) -> PeerIdentity:
        if tickets is None:
            return PeerIdentity(session_id=peer_id)
        if prepared is None or not prepared.message.ticket:
            raise AuthError("the offer came without a ticket", code="auth.bad_ticket")
        return tickets(prepared.message.ticket, prepared.message)

    def connected(self, peer_id: str) -> None:
        self._places.connected(peer_id)

    def forget(self, peer_id: str) -> str | None:
        """The peer is over; its phase (``connecting`` or ``connected``), or ``None`` if it was unknown."""
        self._prepared.pop(peer_id, None)
        self._candidates.pop(peer_id, None)
        self._identities.pop(peer_id, None)
        self._certificates.pop(peer_id, None)
        return self._places.leave(peer_id)

    def status(self, *, several: bool) -> wire.RobotStatus:
        """What the robot says of itself (numbers of the original server)."""
        if several:
            is_full = self._places.is_full
            return wire.RobotStatus.RTC_CONNECTED if is_full else wire.RobotStatus.READY_TO_CONNECT
        if "connected" in self._places.phases.values():
            return wire.RobotStatus.RTC_CONNECTED
        return wire.RobotStatus.RTC_CONNECTING if self._places else wire.RobotStatus.READY_TO_CONNECT

    def _forget_old(self, now_s: float) -> None:
        for peer_id in [key for key, entry in self._prepared.items() if now_s - entry.at_s > PREPARED_FOR_S]:
            del self._prepared[peer_id]


def fingerprints(sdp: str) -> frozenset[str]:
    """Of the certificates that a session description names: whose offers have the same ones are one and the same peer
    connection."""
    prefix = "a=fingerprint:"
    return frozenset(line.removeprefix(prefix).strip().lower() for line in sdp.splitlines() if line.startswith(prefix))
