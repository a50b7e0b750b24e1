"""The places that a robot has for operators: one is kept for supervisors, an account takes no more than half of them,
and who has not connected yet leaves first.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.control import Role

HALF_OPEN_S = 5.0
"""A connection is set up within a second or two: one that takes longer may have to leave for anybody's sake."""
OFFERS_HZ = 2.0
OFFERS_AT_ONCE = 16
"""Of one account: a browser with all its tabs comes back after a break."""
ROOM_TO_KEEP = 4
"""A robot with fewer places has none to keep free."""
MAX_ACCOUNTS = 1024
"""Whose rate is remembered."""


@dataclass(frozen=True, slots=True)
class Comer:
    """An operator who wants a place on a robot. ``account``: as its ticket says; empty where an original server sends
    none. Nobody can be told from others then: each counts as an account of its own for places, and all share one rate
    of offers, for whoever comes under a new name each time would have none."""

    peer_id: str
    account: str
    session_id: str
    role: Role


@dataclass(slots=True)
class _Place:
    comer: Comer
    since_s: float
    is_connected: bool = False

    @property
    def account(self) -> str:
        return self.comer.account or f"peer:{self.comer.peer_id}"


class NoPlace(Exception):
    """A refusal of a peer because the robot has no place for it, with the reason code."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


class RobotPlaces:
    """Gives the places of one robot to operators, and limits their offers. ``now_s`` is any monotonic clock."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._per_account = max(2, count // 2)
        self._for_supervisors = 1 if count >= ROOM_TO_KEEP else 0
        self._taken: dict[str, _Place] = {}
        self._rates: dict[str, TokenBucket] = {}

    def __contains__(self, peer_id: str) -> bool:
        return peer_id in self._taken

    def __len__(self) -> int:
        return len(self._taken)

    @property
    def is_full(self) -> bool:
        """Whether nobody who comes could be given a place."""
        return len(self._taken) >= self._count and all(place.is_connected for place in self._taken.values())

    @property
    def phases(self) -> dict[str, str]:
        """``connecting`` or ``connected``, by peer, the oldest first."""
        return {peer_id: "connected" if place.is_connected else "connecting" for peer_id, place in self._taken.items()}

    def take(self, comer: Comer, now_s: float) -> tuple[str, ...]:
        """Give ``comer`` a place. The peers that have left theirs for it; raises :class:`NoPlace`."""
        self._pace(comer.account, now_s)
        leaver = self._leaver(comer, now_s)
        if leaver is not None:
            del self._taken[leaver.comer.peer_id]
        self._taken[comer.peer_id] = _Place(comer, now_s)
        return () if leaver is None else (leaver.comer.peer_id,)

    def connected(self, peer_id: str) -> None:
        if peer_id in self._taken:
            self._taken[peer_id].is_connected = True

    def leave(self, peer_id: str) -> str | None:
        """Its phase until now; ``None`` if it had no place."""
        phase = self.phases.get(peer_id)
        self._taken.pop(peer_id, None)
        return phase

    def _pace(self, account: str, now_s: float) -> None:
        if account not in self._rates and len(self._rates) >= MAX_ACCOUNTS:
            del self._rates[next(iter(self._rates))]
        rate = self._rates.setdefault(account, TokenBucket(OFFERS_HZ, OFFERS_AT_ONCE))
        if not rate.admits(now_s):
            raise NoPlace("signal.too_slow", "offers of this account come faster than they are answered")

    def _leaver(self, comer: Comer, now_s: float) -> _Place | None:
        """Who must leave, if anybody."""
        own = [place for place in self._taken.values() if place.account == comer.account]
        if len(own) >= self._per_account:
            message = f"this account already has {len(own)} of the robot's {self._count} places"
            return self._first(own, own, comer, message)
        ordinary = sum(place.comer.role != "supervisor" for place in self._taken.values())
        is_kept = comer.role != "supervisor" and ordinary >= self._count - self._for_supervisors
        if len(self._taken) < self._count and not is_kept:
            return None
        message = f"the robot already has {len(self._taken)} operators"
        candidates = [place for place in self._taken.values() if not is_kept or place.comer.role != "supervisor"]
        taken = Counter(place.account for place in candidates)
        greedy = [
            place
            for place in sorted(candidates, key=lambda one: (-taken[one.account], one.since_s))
            if taken[place.account] > len(own) + 1 or now_s - place.since_s > HALF_OPEN_S
        ]
        return self._first([*own, *greedy], own, comer, message)

    @staticmethod
    def _first(half_open: list[_Place], own: list[_Place], comer: Comer, message: str) -> _Place:
        """The first that has not connected yet; else the connection that ``comer`` wants to replace by this one."""
        for place in half_open:
            if not place.is_connected:
                return place
        for place in own:
            if place.comer.session_id == comer.session_id:
                return place
        raise NoPlace("signal.robot_busy", message)
