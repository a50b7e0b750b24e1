"""Grants leases, which say who may command: one holder per resource, fenced by an epoch; a person's choice beats a
program's.

::

    free ──request──► held ──release, expiry, leaving──► held by the first in the queue, or free
                       │ ▲
                       └─┘ hand-over, a person instead of a program, a supervisor by force, same session on a new peer

Every arrow into *held* draws a new epoch, so an epoch names one grant of one resource.
"""

from __future__ import annotations

from collections.abc import Iterable

from mosaic_core.machines.control.lease_events import (
    Commanded,
    DeadlinePassed,
    Effect,
    Event,
    Kept,
    LeaseChanged,
    LegacyPeers,
    Party,
    PartyJoined,
    PartyLeft,
    QueueChanged,
    Released,
    Reply,
    RequestAnswered,
    Requested,
    Waiting,
)
from mosaic_core.machines.control.resource_lease import ResourceLease

LEASE_EXPIRY_S = 2.0
"""Four keep-alives (0.5 s apart): three may be late before somebody counts as gone."""
MAX_PEERS = 1024
"""More than a robot admits by far; whoever comes after them is a stranger who may not command."""
EPOCH_MAX = 0xFFFFFFFF


class LeaseDesk:
    """The leases of one robot. ``now_s`` is any monotonic clock; not thread-safe.

    ``first_epoch``: drawn at random per boot, so that a command of before a restart fits no lease of after it.
    """

    def __init__(
        self,
        resources: Iterable[str],
        *,
        expiry_s: float = LEASE_EXPIRY_S,
        first_epoch: int = 1,
        legacy: LegacyPeers = "allow",
    ) -> None:
        if not expiry_s > 0:  # nor NaN
            raise ValueError("a lease's expiry must be positive")
        self.expiry_s = expiry_s
        self._legacy = legacy
        self._next_epoch = first_epoch % EPOCH_MAX or 1
        self._leases = {resource: ResourceLease(resource, expiry_s) for resource in resources}
        self._peers: dict[str, Party] = {}

    @property
    def resources(self) -> tuple[str, ...]:
        return tuple(self._leases)

    def add(self, resources: Iterable[str]) -> tuple[str, ...]:
        """Resources that there are from now on; those that were new."""
        new = tuple(one for one in dict.fromkeys(resources) if one not in self._leases)
        self._leases.update({one: ResourceLease(one, self.expiry_s) for one in new})
        return new

    @property
    def deadline_s(self) -> float | None:
        """When the next lease expires; the driver says :class:`DeadlinePassed` then. ``None``: never."""
        times = (lease.ends_at_s for lease in self._leases.values())
        return min((time_s for time_s in times if time_s is not None), default=None)

    def holder(self, resource: str) -> Party | None:
        lease = self._leases.get(resource)
        return lease.holder if lease else None

    def epoch(self, resource: str) -> int:
        """Of the present grant; 0: nobody holds it."""
        lease = self._leases.get(resource)
        return lease.epoch if lease and lease.holder else 0

    def queue(self, resource: str) -> tuple[Waiting, ...]:
        """Whose turn comes when: persons before programs, then first come."""
        lease = self._leases.get(resource)
        return tuple(lease.queue) if lease else ()

    def holds_any(self, peer_id: str, now_s: float) -> bool:
        """Whether this peer commands anything."""
        return any(lease.is_held_by(peer_id) and not lease.has_expired(now_s) for lease in self._leases.values())

    def party(self, peer_id: str) -> Party | None:
        return self._peers.get(peer_id)

    def refusal(self, peer_id: str, resource: str, epoch: int | None, now_s: float) -> str | None:
        """Why a command of this peer may not act, ``None`` if it may. ``epoch``: of its frame, ``None``: no frame."""
        lease = self._leases.get(resource)
        if lease is None:
            return "lease.unknown_resource"
        party = self._peers.get(peer_id)
        if party is None:
            return "lease.required" if lease.holder is None else "lease.not_holder"
        if not self._may_command(party):
            return "lease.forbidden" if party.role == "observer" else "lease.original_observes"
        return lease.refusal(party, epoch, now_s)

    def handle(self, event: Event, now_s: float) -> list[Effect]:
        """What to do now, in order. What has expired by ``now_s`` ends before the event counts."""
        # first of all: who leaves gets nothing of what now ends
        effects = self._forget(event.peer_id) if isinstance(event, PartyLeft) else []
        effects += self._expired(now_s)
        match event:
            case Commanded(peer_id, resource):
                effects += self._commanded(peer_id, resource, now_s)
            case Kept(peer_id, epochs):
                for resource, epoch in epochs.items():
                    self._kept(peer_id, resource, epoch, now_s)
            case Requested():
                effects += self._requested(event, now_s)
            case Released(peer_id, resource):
                effects += self._released(peer_id, resource, now_s)
            case RequestAnswered():
                effects += self._answered(event, now_s)
            case PartyJoined(party):
                effects += self._joined(party, now_s)
            case PartyLeft(peer_id, on_purpose):
                effects += self._left(peer_id, now_s) if on_purpose else []
            case DeadlinePassed():
                pass
        return effects

    # -- signs of life

    def _expired(self, now_s: float) -> list[Effect]:
        effects: list[Effect] = []
        for lease in self._leases.values():
            if lease.has_expired(now_s):
                effects += self._end(lease, "lease.expired", "", now_s)
        return effects

    def _kept(self, peer_id: str, resource: str, epoch: int, now_s: float) -> None:
        lease = self._leases.get(resource)
        if lease is not None and lease.is_held_by(peer_id) and lease.epoch == epoch:
            lease.keep(now_s)

    def _commanded(self, peer_id: str, resource: str, now_s: float) -> list[Effect]:
        lease, party = self._leases.get(resource), self._peers.get(peer_id)
        if lease is None or party is None:
            return []
        if lease.is_held_by(peer_id):
            lease.keep(now_s)
        elif lease.holder is None and party.is_original and not lease.queue and self._may_command(party):
            return self._give(lease, party, "", _name(party), now_s)
        return []

    # -- coming and going

    def _joined(self, party: Party, now_s: float) -> list[Effect]:
        known = self._peers.get(party.peer_id)
        if not party.peer_id or known == party or (known is None and len(self._peers) >= MAX_PEERS):
            return []
        effects: list[Effect] = []
        if not (self._may_command(party) and self._is_continued(party)):
            effects = [*self._forget(party.peer_id), *self._left(party.peer_id, now_s)]  # what it had isn't this one's
        self._peers[party.peer_id] = party
        for lease in self._leases.values():
            if lease.is_held_by(party.peer_id):
                lease.holder = party
            if lease.queue.update(party):
                effects.append(QueueChanged(lease.resource))
        return effects

    def _is_continued(self, party: Party) -> bool:
        """Whether what this peer id has belongs to the same session as before."""
        known = self._peers.get(party.peer_id)
        if known is not None:
            return known.session_id == party.session_id
        holders = [lease.holder for lease in self._leases.values() if lease.holder is not None]
        mine = [holder for holder in holders if holder.peer_id == party.peer_id]
        return party.session_id != "" and all(holder.session_id == party.session_id for holder in mine)

    def _forget(self, peer_id: str) -> list[Effect]:
        """Nothing is said or given to it any more."""
        self._peers.pop(peer_id, None)
        return [QueueChanged(lease.resource) for lease in self._leases.values() if lease.queue.drop_peer(peer_id)]

    def _left(self, peer_id: str, now_s: float) -> list[Effect]:
        effects: list[Effect] = []
        for lease in self._leases.values():
            if lease.holder is not None and lease.holder.peer_id == peer_id:
                effects += self._end(lease, "lease.peer_left", _name(lease.holder), now_s)
        return effects

    # -- asking

    def _requested(self, event: Requested, now_s: float) -> list[Effect]:
        party = self._peers.get(event.peer_id)
        if party is None or party.is_original:
            return []
        lease = self._leases.get(event.resource)
        if lease is None:
            return self._reply(party, event.resource, "lease.unknown_resource")
        if not self._may_command(party):
            return self._reply(party, lease.resource, "lease.forbidden")
        if event.force and not (party.role == "supervisor" and event.reason.strip()):
            return self._reply(party, lease.resource, "lease.force_forbidden")
        holder = lease.holder
        if holder is None:
            return self._give(lease, party, "", _name(party), now_s)
        if holder.peer_id == party.peer_id:
            lease.keep(now_s)
            return [Reply(party.peer_id, lease.resource, "granted", lease.epoch)]
        if holder.is_same_session(party):
            return self._give(lease, party, "peer.replaced", _name(party), now_s)
        if holder.is_person and not party.is_person:
            return self._reply(party, lease.resource, "lease.person_commands")
        if party.is_person and not holder.is_person and not event.force:
            return self._give(lease, party, "lease.preempted", _name(party), now_s, event.reason)
        if event.force:
            return self._give(lease, party, "lease.taken_over", _name(party), now_s, event.reason)
        return self._wait(lease, Waiting(party, event.reason, now_s))

    def _wait(self, lease: ResourceLease, waiting: Waiting) -> list[Effect]:
        party = waiting.party
        displaced = lease.queue.add(waiting)
        if displaced is party:
            return self._reply(party, lease.resource, "lease.denied", "too many wait already")
        effects = self._reply(displaced, lease.resource, "lease.person_commands") if displaced else []
        queued = Reply(party.peer_id, lease.resource, "queued", 0, "lease.queued")
        return [*effects, queued, QueueChanged(lease.resource)]

    def _released(self, peer_id: str, resource: str, now_s: float) -> list[Effect]:
        party, lease = self._peers.get(peer_id), self._leases.get(resource)
        if party is None or party.is_original:
            return []
        if lease is None:
            return self._reply(party, resource, "lease.unknown_resource")
        told: list[Effect] = [Reply(peer_id, resource, "ended", 0, "lease.released")]
        if lease.holder is not None and lease.holder.is_same_session(party):
            ended = self._end(lease, "lease.released", _name(party), now_s)
            return ended if told[0] in ended else [*told, *ended]
        return [*told, QueueChanged(resource)] if lease.queue.drop_session(party) else told

    def _answered(self, event: RequestAnswered, now_s: float) -> list[Effect]:
        lease = self._leases.get(event.resource)
        if lease is None or lease.holder is None or lease.holder.peer_id != event.peer_id:
            return []
        party = lease.queue.find(event.to_peer_id)
        if party is None:
            return []
        if event.grant:
            return self._give(lease, party, "lease.handed_over", _name(lease.holder), now_s, event.message)
        lease.queue.drop_session(party)
        return [*self._reply(party, lease.resource, "lease.denied", event.message), QueueChanged(lease.resource)]

    # -- giving and ending

    def _give(
        self, lease: ResourceLease, party: Party, cause: str, by: str, now_s: float, message: str = ""
    ) -> list[Effect]:
        before = lease.holder
        lease.holder, lease.epoch, lease.alive_s = party, self._next_epoch, now_s
        self._next_epoch = self._next_epoch % EPOCH_MAX + 1
        lease.queue.drop_session(party)
        changed = LeaseChanged(lease.resource, party, lease.epoch, cause, by, before, message)
        effects = [*self._ended(before, lease.resource, cause, message), changed]
        if not party.is_original:
            effects.append(Reply(party.peer_id, lease.resource, "granted", lease.epoch))
        return effects

    def _end(self, lease: ResourceLease, cause: str, by: str, now_s: float) -> list[Effect]:
        following = lease.queue.first
        if following is not None:
            return self._give(lease, following, cause, by, now_s)
        before, lease.holder = lease.holder, None
        return [
            *self._ended(before, lease.resource, cause, ""),
            LeaseChanged(lease.resource, None, 0, cause, by, before),
        ]

    def _ended(self, before: Party | None, resource: str, cause: str, message: str) -> list[Effect]:
        if before is None or before.is_original or before.peer_id not in self._peers:
            return []
        return [Reply(before.peer_id, resource, "ended", 0, cause, message)]

    def _reply(self, party: Party, resource: str, code: str, message: str = "") -> list[Effect]:
        return [Reply(party.peer_id, resource, "denied", 0, code, message)]

    def _may_command(self, party: Party) -> bool:
        return party.role in ("operator", "supervisor") and (not party.is_original or self._legacy == "allow")


def _name(party: Party) -> str:
    return party.name or party.peer_id
