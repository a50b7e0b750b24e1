"""Jittered exponential back-off: every failure waits longer, a long success starts over.

Jitter keeps a thousand robots from returning at the same moment after their server restarted.
"""

from __future__ import annotations

from dataclasses import dataclass


def again_in(delay_s: float) -> str:
    """How a log says when the next attempt comes: ``at once``, ``in 0.5 s``."""
    return f"in {delay_s:.1f} s" if delay_s >= 0.05 else "at once"


@dataclass(frozen=True, slots=True)
class BackoffPolicy:
    """The delays between attempts: ``first_s``, then ``factor`` times more each time up to ``max_s``; each shortened by
    up to ``jitter`` of it.
    """

    first_s: float = 0.5
    factor: float = 2.0
    max_s: float = 30.0
    jitter: float = 0.3
    stable_s: float = 10.0
    """Something that ran for this long before it failed counts as healthy: its next failure is a first one."""

    def __post_init__(self) -> None:
        if not (0 < self.first_s <= self.max_s and self.factor >= 1 and 0 <= self.jitter < 1):
            raise ValueError("a back-off needs 0 < first_s <= max_s, factor >= 1 and 0 <= jitter < 1")


class Backoff:
    """Counts the failures of one thing."""

    def __init__(self, policy: BackoffPolicy | None = None) -> None:
        self._policy = policy or BackoffPolicy()
        self._base_s: float | None = None

    def failed(self, ran_for_s: float, random_unit: float) -> float:
        """Seconds to wait before the next attempt. ``random_unit`` is a random number of [0, 1)."""
        policy = self._policy
        if self._base_s is None or ran_for_s >= policy.stable_s:
            self._base_s = policy.first_s
        else:
            self._base_s = min(policy.max_s, self._base_s * policy.factor)
        return self._base_s * (1 - policy.jitter * random_unit)

    def reset(self) -> None:
        """Forget all failures."""
        self._base_s = None
