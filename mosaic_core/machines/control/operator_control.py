"""Keeps the leases of a robot as an operator knows them, and says what takes, keeps and gives them back.

The robot decides; this machine asks, remembers the answers, and keeps alive what is held. ``now_s`` is any monotonic
clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.words import control
from mosaic_core.words.control import LEASE_KEEP_PERIOD_S, ControlMessage, LeaseWaiting, PeerInfo, SafetyLimit

DEFAULT_EXPIRY_S = 2.0


@dataclass(frozen=True, slots=True)
class LeaseView:
    """The lease of ``resource``, as the operator knows it: who commands it. ``epoch`` is the one of the current grant;
    ``is_mine``: this connection holds it."""

    resource: str
    holder: PeerInfo | None = None
    epoch: int = 0
    queue: tuple[LeaseWaiting, ...] = ()
    expiry_s: float = DEFAULT_EXPIRY_S
    is_mine: bool = False


@dataclass(frozen=True, slots=True)
class ControlHeard:
    """A message of the robot."""

    message: ControlMessage


@dataclass(frozen=True, slots=True)
class Asked:
    """The program wants to command."""

    resource: str
    reason: str = ""
    force: bool = False


@dataclass(frozen=True, slots=True)
class GaveUp:
    """The program gives a lease back, or waits for it no longer."""

    resource: str


@dataclass(frozen=True, slots=True)
class ConnectionEnded:
    """The connection is over: nothing of what was known holds any more."""

    code: str
    message: str = ""


Event = ControlHeard | Asked | GaveUp | ConnectionEnded | DeadlinePassed


@dataclass(frozen=True, slots=True)
class Say:
    """Tell the robot."""

    message: ControlMessage


@dataclass(frozen=True, slots=True)
class Granted:
    """The robot granted a lease."""

    resource: str
    epoch: int


@dataclass(frozen=True, slots=True)
class Queued:
    """The lease is not given now; it may still be granted or denied."""

    resource: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class Denied:
    """The robot denied a lease; ``code`` says why."""

    resource: str
    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class Lost:
    """A lease that was held is held no longer, and not because the program gave it back."""

    resource: str
    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class ControlChanged:
    """Something to show: leases, peers, the stop or the limits."""


Effect = Say | Granted | Queued | Denied | Lost | ControlChanged


class OperatorControl:
    """Asks the robot for leases, keeps those that are held alive, and remembers who commands what.

    ``peer_id`` is the connection's own.
    """

    def __init__(self, peer_id: str) -> None:
        self._peer_id = peer_id
        self.peers: tuple[PeerInfo, ...] = ()
        self.leases: dict[str, LeaseView] = {}
        self.stop_state: control.StopState | None = None
        self.limits: dict[str, SafetyLimit] = {}
        self.deadline_s: float | None = None
        """When the driver must say :class:`DeadlinePassed`; ``None``: never."""
        self._held: dict[str, int] = {}
        self._asked: set[str] = set()

    @property
    def held(self) -> Mapping[str, int]:
        """Resource → epoch of what this connection holds."""
        return self._held

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order."""
        match event:
            case ControlHeard(message):
                return self._heard(message, now_s)
            case Asked(resource, reason, force):
                self._asked.add(resource)
                return [Say(control.LeaseRequest(resource=resource, reason=reason, force=force))]
            case GaveUp(resource):
                return self._given_up(resource)
            case ConnectionEnded(code, message):
                return self._ended(code, message)
            case DeadlinePassed():
                return self._overdue(now_s)

    def _heard(self, message: ControlMessage, now_s: float) -> list[Effect]:
        match message:
            case control.LeaseReply():
                return self._replied(message, now_s)
            case control.LeaseState():
                return self._state(message)
            case control.Peers(you=you, peers=peers):
                self._peer_id, self.peers = you, peers
            case control.StopState():
                self.stop_state = message
            case control.SafetyLimit(label=label):
                self.limits[label] = message
            case _:
                return []
        return [ControlChanged()]

    def _replied(self, reply: control.LeaseReply, now_s: float) -> list[Effect]:
        resource, text = reply.resource, reply.message or ""
        match reply.outcome:
            case "granted":
                return self._granted(resource, reply.epoch, now_s)
            case "queued":
                return [Queued(resource, text)] if resource in self._asked else []
            case "denied":
                was_asked = resource in self._asked
                self._asked.discard(resource)
                return [Denied(resource, reply.code or "lease.denied", text)] if was_asked else []
            case "ended":
                lost = self._lost(resource, reply.code or "lease.not_holder", text)
                return [*lost, ControlChanged()] if lost else []

    def _granted(self, resource: str, epoch: int, now_s: float) -> list[Effect]:
        if resource not in self._asked and resource not in self._held:
            return []  # the answer crossed our giving up: the robot hears that next and takes it back
        self._asked.discard(resource)
        self._held[resource] = epoch
        if self.deadline_s is None:
            self.deadline_s = now_s + LEASE_KEEP_PERIOD_S
        self._show_as_mine(resource)
        return [Granted(resource, epoch), ControlChanged()]

    def _show_as_mine(self, resource: str) -> None:
        view = self.leases.get(resource, LeaseView(resource))
        self.leases[resource] = replace(view, is_mine=resource in self._held)

    def _state(self, state: control.LeaseState) -> list[Effect]:
        effects: list[Effect] = []
        epoch = self._held.get(state.resource)
        is_another = state.holder is None or state.holder.peer_id != self._peer_id
        if epoch is not None and state.epoch != epoch and state.holder is not None and is_another:
            effects = self._lost(state.resource, "lease.not_holder", "")
        self.leases[state.resource] = LeaseView(
            state.resource, state.holder, state.epoch, state.queue, state.expiry_s, state.resource in self._held
        )
        return [*effects, ControlChanged()]

    def _lost(self, resource: str, code: str, message: str) -> list[Effect]:
        """Who only waits has lost nothing: the robot also says ``ended`` to what was given up before."""
        if self._held.pop(resource, None) is None:
            return []
        self._rest_if_idle()
        self._show_as_mine(resource)
        return [Lost(resource, code, message)]

    def _rest_if_idle(self) -> None:
        if not self._held:
            self.deadline_s = None

    def _given_up(self, resource: str) -> list[Effect]:
        is_known = resource in self._held or resource in self._asked
        self._held.pop(resource, None)
        self._asked.discard(resource)
        self._rest_if_idle()
        self._show_as_mine(resource)
        return [Say(control.LeaseRelease(resource=resource)), ControlChanged()] if is_known else []

    def _ended(self, code: str, message: str) -> list[Effect]:
        effects: list[Effect] = []
        for resource in tuple(self._held):
            effects += self._lost(resource, code, message)
        effects += [Denied(resource, code, message) for resource in sorted(self._asked)]
        self._asked.clear()
        self.peers, self.leases, self.stop_state, self.limits = (), {}, None, {}
        return [*effects, ControlChanged()]

    def _overdue(self, now_s: float) -> list[Effect]:
        if self.deadline_s is None or now_s < self.deadline_s:
            return []
        self.deadline_s = now_s + LEASE_KEEP_PERIOD_S
        return [Say(control.LeaseKeep(epochs=dict(self._held)))]
