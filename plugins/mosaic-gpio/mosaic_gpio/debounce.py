"""Decides which changes of a contact are told: it bounces for milliseconds, and each bounce is an edge. Pure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Debounce:
    """Tells the first edge at once, and is deaf for ``quiet_s`` after it. Ask again when that is over: it may have
    changed meanwhile."""

    quiet_s: float
    is_on: bool
    at_s: float = float("-inf")
    changes: int = 0

    def changed(self, is_on: bool, now_s: float) -> bool:
        """Whether to tell that it is so now."""
        if is_on == self.is_on or now_s - self.at_s < self.quiet_s:
            return False
        self.is_on, self.at_s = is_on, now_s
        self.changes += 1
        return True
