"""A device that is away for thirty seconds, on clocks that tests turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.testing import FakeClock

AWAY_S = 30.0
BETWEEN_S = 5.0
HASTE = 1000
"""By how much the waits of a thread of its own are shortened, so that thirty seconds of them pass in no time."""


def thirty_seconds(clock: FakeClock) -> Iterator[None]:
    """Each time that the robot tries again, until they are over."""
    for _ in range(round(AWAY_S / BETWEEN_S)):
        clock.advance(BETWEEN_S)
        yield


def hasty(policy: BackoffPolicy) -> BackoffPolicy:
    """The same waits on a clock that runs :data:`HASTE` times as fast."""
    return replace(policy, first_s=policy.first_s / HASTE, max_s=policy.max_s / HASTE)


def tries_in_thirty_seconds(policy: BackoffPolicy) -> int:
    """How often a thread tries that waits so long in between."""
    backoff, left_s, tries = Backoff(policy), AWAY_S, 0
    while left_s > 0:
        left_s -= backoff.failed(0.0, 0.0)
        tries += 1
    return tries
