"""Queues those who wait for a lease: persons before programs, then first come; every session stands in a queue once."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.machines.control.lease_events import Party, Waiting

MAX_WAITING = 32
"""Nobody waits for the thirty-third turn; a hostile peer must not fill the memory."""


class LeaseQueue:
    """The queue of one resource. It never holds more than :data:`MAX_WAITING`."""

    def __init__(self) -> None:
        self._waiting: list[Waiting] = []

    def __len__(self) -> int:
        return len(self._waiting)

    def __iter__(self) -> Iterator[Waiting]:
        return iter(self._waiting)

    @property
    def first(self) -> Party | None:
        return self._waiting[0].party if self._waiting else None

    def find(self, peer_id: str) -> Party | None:
        return next((one.party for one in self._waiting if one.party.peer_id == peer_id), None)

    def add(self, waiting: Waiting) -> Party | None:
        """Stand in line, or keep the place that the session has there. The party that does not stand in line now: a
        program that makes room for a person, or the asker itself if nobody does; ``None``: there was room."""
        for place, other in enumerate(self._waiting):
            if other.party.is_same_session(waiting.party):
                del self._waiting[place]
                self._insert(Waiting(waiting.party, waiting.reason, other.since_s))
                return None
        displaced = None
        if len(self._waiting) >= MAX_WAITING:
            last = self._waiting[-1].party
            if last.is_person or not waiting.party.is_person:
                return waiting.party
            displaced = self._waiting.pop().party
        self._insert(waiting)
        return displaced

    def update(self, party: Party) -> bool:
        """A peer that waits is another party now; whether it waits."""
        for place, other in enumerate(self._waiting):
            if other.party.peer_id == party.peer_id:
                del self._waiting[place]
                self._insert(Waiting(party, other.reason, other.since_s))
                return True
        return False

    def drop_peer(self, peer_id: str) -> bool:
        """Whether it waited."""
        return self._keep([one for one in self._waiting if one.party.peer_id != peer_id])

    def drop_session(self, party: Party) -> bool:
        """Whether the session of ``party`` waited."""
        return self._keep([one for one in self._waiting if not one.party.is_same_session(party)])

    def _keep(self, kept: list[Waiting]) -> bool:
        is_changed = len(kept) != len(self._waiting)
        self._waiting = kept
        return is_changed

    def _insert(self, waiting: Waiting) -> None:
        rank = (not waiting.party.is_person, waiting.since_s)
        later = (at for at, one in enumerate(self._waiting) if (not one.party.is_person, one.since_s) > rank)
        self._waiting.insert(next(later, len(self._waiting)), waiting)
