"""Divides the budget of one connection among its streams: everyone's least first, then by rank, and within a rank by
weight. What one does not need goes to the others.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import TypeVar

S = TypeVar("S", bound=Hashable)

DRIVES, SEEN = 0, 1
"""Ranks: pictures that the robot is driven by are served before all others."""


@dataclass(frozen=True, slots=True)
class Demand:
    """The bandwidth that one stream can use. ``rank``: the lowest is served first; ``weight``: its part of what its
    rank gets beyond everyone's least, such as how large it is shown."""

    least_bps: int
    most_bps: int
    rank: int = SEEN
    weight: float = 1.0


def allocated(budget_bps: float, demands: Mapping[S, Demand]) -> dict[S, int]:
    """Each stream's part. Together never more than the budget; nobody gets less than its least if the budget allows
    that for all, else those of lower rank go short first."""
    parts: dict[S, float] = {}
    left_bps = max(0.0, budget_bps)
    ranks = _by_rank(demands)
    for streams in ranks:
        needed_bps = sum(demands[stream].least_bps for stream in streams)
        share = min(1.0, left_bps / needed_bps) if needed_bps else 0.0
        parts |= {stream: share * demands[stream].least_bps for stream in streams}
        left_bps = max(0.0, left_bps - needed_bps)
    for streams in ranks:
        more = _filled(left_bps, {stream: demands[stream] for stream in streams})
        left_bps -= sum(more.values())
        parts |= {stream: parts[stream] + bps for stream, bps in more.items()}
    return {stream: int(bps) for stream, bps in parts.items()}


def _by_rank(demands: Mapping[S, Demand]) -> list[list[S]]:
    in_order = sorted(demands, key=lambda stream: demands[stream].rank)
    return [list(streams) for _, streams in groupby(in_order, key=lambda stream: demands[stream].rank)]


def _filled(budget_bps: float, demands: Mapping[S, Demand]) -> dict[S, float]:
    """Beyond the least: equal levels above it per weight, up to everyone's most (water-filling)."""
    caps = {stream: float(max(0, one.most_bps - one.least_bps)) for stream, one in demands.items()}
    weights = {stream: max(1e-6, one.weight) for stream, one in demands.items()}
    filled: dict[S, float] = {}
    left_bps = max(0.0, budget_bps)
    for stream in sorted(caps, key=lambda stream: caps[stream] / weights[stream]):
        level_bps = left_bps / _sum(weights[other] for other in caps if other not in filled)
        filled[stream] = min(caps[stream], level_bps * weights[stream])
        left_bps = max(0.0, left_bps - filled[stream])
    return filled


def _sum(values: Iterable[float]) -> float:
    return sum(values) or 1.0
