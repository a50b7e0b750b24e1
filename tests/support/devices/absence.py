"""A device that is away for thirty seconds, on clocks that tests turn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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


def hasty(waits_s: Sequence[float]) -> tuple[float, ...]:
    """The same waits on a clock that runs :data:`HASTE` times as fast."""
    return tuple(one / HASTE for one in waits_s)


def tries_in_thirty_seconds(waits_s: Sequence[float]) -> int:
    """How often a thread tries that waits so long in between; the last wait repeats."""
    left_s, tries = AWAY_S, 0
    while left_s > 0:
        left_s -= waits_s[min(tries, len(waits_s) - 1)]
        tries += 1
    return tries
