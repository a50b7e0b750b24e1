"""Declares what happens to leases and what follows: the vocabulary of ``LeaseDesk``, see ``lease_desk.py``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.words.control import Role

LeaseOutcome = Literal["granted", "queued", "denied", "ended"]
LegacyPeers = Literal["allow", "observe", "refuse"]


@dataclass(frozen=True, slots=True)
class Party:
    """An operator on one of its peer connections. ``role`` comes from the signed ticket. ``is_original``: it knows
    nothing of leases. A session outlives its peer connections; an empty one is shared with nobody."""

    peer_id: str
    session_id: str
    name: str = ""
    role: Role = "operator"
    is_person: bool = False
    is_original: bool = False
    account: str | None = None
    """The id of its account, as its ticket says."""

    def is_same_session(self, other: Party) -> bool:
        return self.peer_id == other.peer_id or (self.session_id != "" and self.session_id == other.session_id)


@dataclass(frozen=True, slots=True)
class Waiting:
    """Somebody in a queue."""

    party: Party
    reason: str
    since_s: float


@dataclass(frozen=True, slots=True)
class PartyJoined:
    """A peer is there, or something about it has changed (a late hello)."""

    party: Party


@dataclass(frozen=True, slots=True)
class PartyLeft:
    """A peer is gone. ``on_purpose``: it said so (bye, closed); otherwise it was lost and its session may return."""

    peer_id: str
    on_purpose: bool


@dataclass(frozen=True, slots=True)
class Requested:
    """A session asks for the lease of a resource."""

    peer_id: str
    resource: str
    reason: str = ""
    force: bool = False


@dataclass(frozen=True, slots=True)
class Released:
    """A session gives back the lease that it holds, or no longer waits for it."""

    peer_id: str
    resource: str


@dataclass(frozen=True, slots=True)
class RequestAnswered:
    """The holder says yes or no to ``to_peer_id``, who waits."""

    peer_id: str
    resource: str
    to_peer_id: str
    grant: bool
    message: str = ""


@dataclass(frozen=True, slots=True)
class Kept:
    """A keep-alive: the epochs that the peer believes it holds, by resource."""

    peer_id: str
    epochs: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command was accepted: a keep-alive of the holder, and how an original peer takes a free lease."""

    peer_id: str
    resource: str


Event = PartyJoined | PartyLeft | Requested | Released | RequestAnswered | Kept | Commanded | DeadlinePassed


@dataclass(frozen=True, slots=True)
class Reply:
    """Tell ``peer_id``. Never addressed to an original peer, nor to one that has left."""

    peer_id: str
    resource: str
    outcome: LeaseOutcome
    epoch: int = 0
    code: str = ""
    message: str = ""


@dataclass(frozen=True, slots=True)
class LeaseChanged:
    """The lease of a resource has changed hands. ``resource`` belongs to ``holder`` from now on, ``None``: to nobody,
    and no longer to ``before``.

    ``cause`` is the code of why ``before`` lost it, empty if it was free. ``by``: name or peer id of whoever did it,
    empty if time did. Drop what ``before`` has queued, make safe what it moved, close its permits, tell everybody.
    """

    resource: str
    holder: Party | None
    epoch: int
    cause: str
    by: str
    before: Party | None = None
    message: str = ""


@dataclass(frozen=True, slots=True)
class QueueChanged:
    """Tell everybody who waits for ``resource``; its holder is the same as before."""

    resource: str


Effect = Reply | LeaseChanged | QueueChanged
