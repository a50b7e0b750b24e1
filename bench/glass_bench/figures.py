"""What a list of displayed pictures says: ages, freezes, when it was well again. Pure functions of times."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

FREEZE_S = 0.2
"""A gap between two displayed pictures that an operator notices."""
CALM_S = 2.0
"""A picture is well again when it stays so for this long."""


@dataclass(frozen=True, slots=True)
class Displayed:
    """One picture on the screen: when (monotonic clock), how old then (``None``: not readable), and its height."""

    at_s: float
    age_s: float | None
    height: int
    told_age_s: float | None = None
    """What the page says of its age."""


def rank(values: Sequence[float], share: float) -> float:
    """The nearest rank; NaN without values."""
    return sorted(values)[max(1, math.ceil(share * len(values))) - 1] if values else math.nan


def ages_ms(pictures: Sequence[Displayed]) -> list[float]:
    return [1000 * picture.age_s for picture in pictures if picture.age_s is not None]


def between(pictures: Sequence[Displayed], from_s: float, to_s: float) -> list[Displayed]:
    return [picture for picture in pictures if from_s <= picture.at_s < to_s]


def freezes_per_minute(pictures: Sequence[Displayed], from_s: float, to_s: float) -> float:
    """Gaps of more than :data:`FREEZE_S`, also at both ends of the time: nothing at all is one freeze too."""
    times = [from_s, *(picture.at_s for picture in between(pictures, from_s, to_s)), to_s]
    return sum(late - early > FREEZE_S for early, late in pairwise(times)) * 60 / (to_s - from_s)


def drift_ms(pictures: Sequence[Displayed]) -> float:
    """How much older the pictures of the last third are than those of the first, by their medians."""
    ages = ages_ms(pictures)
    third = len(ages) // 3
    return statistics.median(ages[-third:]) - statistics.median(ages[:third]) if third else math.nan


def well_again_s(pictures: Sequence[Displayed], since_s: float, until_s: float, limit_ms: float) -> float:
    """Seconds from ``since_s`` until for :data:`CALM_S` no gap is a freeze and 95 % of the pictures are younger than
    ``limit_ms``; infinite if that never comes before ``until_s``."""
    starts = [since_s, *(picture.at_s for picture in between(pictures, since_s, until_s))]
    for start_s in starts:
        if start_s + CALM_S > until_s:
            break
        calm = between(pictures, start_s, start_s + CALM_S)
        if not freezes_per_minute(calm, start_s, start_s + CALM_S) and rank(ages_ms(calm), 0.95) <= limit_ms:
            return start_s - since_s
    return math.inf


def rate_reached_s(arrived: Sequence[tuple[float, int]], since_s: float, least_bps: float) -> float:
    """Seconds from ``since_s`` until ``least_bps`` came for :data:`CALM_S`; infinite if never.

    ``arrived``: (monotonic s, bytes so far), the oldest first.
    """
    late = [one for one in arrived if one[0] >= since_s]
    for at_s, size in late:
        earlier = [one for one in late if at_s - one[0] >= CALM_S]
        if earlier and (size - earlier[-1][1]) * 8 / (at_s - earlier[-1][0]) >= least_bps:
            return at_s - since_s
    return math.inf


def mean_bps(arrived: Sequence[tuple[float, int]], from_s: float, to_s: float) -> float:
    inside = [one for one in arrived if from_s <= one[0] < to_s]
    if len(inside) < 2:
        return math.nan
    return (inside[-1][1] - inside[0][1]) * 8 / (inside[-1][0] - inside[0][0])
