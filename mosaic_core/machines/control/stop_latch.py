"""Stop is latched: it holds until a person who commands, or who supervises, clears it on purpose.

Every stop latches, also a late copy of one that was cleared: standing still once too often harms nobody.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.control.lease_events import Party

MAX_IDS = 64
"""Stops that are remembered for their acknowledgements; the oldest is forgotten first."""


@dataclass(frozen=True, slots=True)
class StopTimes:
    """The times that a stop's acknowledgement tells: when the first copy came, and since when everything is safe
    (``None``: not yet).
    """

    received_s: float
    safe_s: float | None


class StopLatch:
    """The stop of one robot. ``now_s`` is its monotonic clock; not thread-safe."""

    def __init__(self) -> None:
        self.is_stopped = False
        self.by = ""
        self.reason = ""
        self.since_s: float | None = None
        self._safe_s: float | None = None
        self._received_s: dict[str, float] = {}

    def stop(self, by: str, reason: str, id: str, now_s: float) -> bool:
        """Stand still. ``True`` if it moved until now: the caller closes permits, drops what is queued, runs every
        safe action and says :meth:`made_safe` when they have returned. ``id`` may be acknowledged at once."""
        is_new = not self.is_stopped
        if is_new:
            self.is_stopped, self.by, self.reason, self.since_s = True, by, reason, now_s
            self._safe_s = None
            self._received_s.clear()  # the times of a copy belong to the stop that it now repeats
        if id not in self._received_s:
            if len(self._received_s) >= MAX_IDS:
                del self._received_s[next(iter(self._received_s))]
            self._received_s[id] = now_s
        return is_new

    def made_safe(self, now_s: float) -> None:
        """Every safe action of this stop has returned. Without a stop, or a second time: nothing happens."""
        if self.is_stopped and self._safe_s is None:
            self._safe_s = now_s

    def times(self, id: str) -> StopTimes | None:
        """For the acknowledgement of ``id``; ``None`` if no such stop is in force."""
        received_s = self._received_s.get(id)
        if received_s is None or not self.is_stopped:
            return None
        return StopTimes(received_s, None if self._safe_s is None else max(received_s, self._safe_s))

    def clear(self, party: Party, holds_a_lease: bool) -> str | None:
        """Let commands act again; the code why not, ``None`` if cleared (or nothing was stopped)."""
        if party.is_original or party.role not in ("operator", "supervisor"):
            return "lease.forbidden"
        if not party.is_person:
            return "safety.person_clears"
        if not holds_a_lease and party.role != "supervisor":
            return "lease.required"
        self.is_stopped, self.by, self.reason, self.since_s, self._safe_s = False, "", "", None, None
        self._received_s.clear()
        return None
