"""What is found of a leader and its follower: how old what this one does is, how long it heard nothing. Pure."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

Sighting = tuple[float, int]
"""When (monotonic seconds), and the place of the joint in ticks."""


@dataclass(frozen=True, slots=True)
class Followed:
    """One way over one network."""

    latencies_ms: Sequence[float]
    """For each place of the leader: until the follower was told to be there, or further on."""
    gaps_ms: Sequence[float]
    """Between two places that the follower was told."""
    missed: int
    """Places that the follower had not reached when the watching ended."""

    def latency_ms(self, share: float) -> float:
        return rank(self.latencies_ms, share)

    @property
    def longest_gap_ms(self) -> float:
        return max(self.gaps_ms, default=math.nan)


def followed(led: Sequence[Sighting], told: Sequence[Sighting]) -> Followed:
    """``led``: where the leader was, ever further on; ``told``: where the follower was told to be."""
    firsts = first_sightings(led)
    begun = [one for one in first_sightings(told) if one[1] > firsts[0][1]]
    places = [ticks for _, ticks in begun]
    latencies, missed = [], 0
    for at_s, ticks in firsts[1:]:
        index = bisect_left(places, ticks)
        if index == len(places):
            missed += 1
        else:
            latencies.append(1e3 * (begun[index][0] - at_s))
    return Followed(latencies, [1e3 * (late - early) for (early, _), (late, _) in pairwise(begun)], missed)


def first_sightings(seen: Sequence[Sighting]) -> list[Sighting]:
    """Of each new farthest place when it was first seen."""
    found: list[Sighting] = []
    for at_s, ticks in seen:
        if not found or ticks > found[-1][1]:
            found.append((at_s, ticks))
    return found


def rank(values: Sequence[float], share: float) -> float:
    """The nearest rank; NaN of nothing."""
    return sorted(values)[max(1, math.ceil(share * len(values))) - 1] if values else math.nan


def table_line(network: str, way: str, one: Followed) -> str:
    """A line of the table in `bench/README.md`."""
    figures = f"{one.latency_ms(0.5):.0f} / {one.latency_ms(0.99):.0f} / {one.latency_ms(1.0):.0f}"
    return f"| {network} | {way} | {figures} | {rank(one.gaps_ms, 0.99):.0f} / {one.longest_gap_ms:.0f} |"
