"""Computes the figures of a row from what was seen in one run. Times in seconds by one clock, ages in milliseconds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

FREEZE_S = 0.2
"""A longer gap between two pictures is seen as one."""


@dataclass(slots=True)
class Seen:
    """The observations of an operator between two times."""

    began_at_s: float = 0.0
    ended_at_s: float = 0.0
    pictures_at_s: list[float] = field(default_factory=list)
    picture_ages_ms: list[float] = field(default_factory=list)
    commands_sent: int = 0
    command_ages_ms: list[float] = field(default_factory=list)
    carried_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Figures:
    """The figures of one run, a row of the table. ``None``: it was not seen at all."""

    profile: str
    connect_s: float | None = None
    first_picture_s: float | None = None
    command_p50_ms: float | None = None
    command_p95_ms: float | None = None
    commands_lost: float | None = None
    """Share of those sent that never reached the robot's handler."""
    picture_p50_ms: float | None = None
    picture_p95_ms: float | None = None
    pictures_per_s: float | None = None
    freezes_per_min: float | None = None
    to_operator_mbps: float | None = None
    recovery_s: float | None = None
    failure: str = ""
    """The reason code, where there is no connection."""


def figures(profile: str, connect_s: float, first_picture_s: float, seen: Seen, recovery_s: float | None) -> Figures:
    """The row of one run."""
    span_s = seen.ended_at_s - seen.began_at_s
    lost = 1 - len(seen.command_ages_ms) / seen.commands_sent if seen.commands_sent else None
    return Figures(
        profile=profile,
        connect_s=connect_s,
        first_picture_s=first_picture_s,
        command_p50_ms=rank(seen.command_ages_ms, 0.5),
        command_p95_ms=rank(seen.command_ages_ms, 0.95),
        commands_lost=None if lost is None else max(0.0, lost),
        picture_p50_ms=rank(seen.picture_ages_ms, 0.5),
        picture_p95_ms=rank(seen.picture_ages_ms, 0.95),
        pictures_per_s=len(seen.pictures_at_s) / span_s,
        freezes_per_min=freezes(seen.pictures_at_s, seen.began_at_s, seen.ended_at_s) * 60 / span_s,
        to_operator_mbps=seen.carried_bytes * 8 / 1e6 / span_s,
        recovery_s=recovery_s,
    )


def rank(values: Sequence[float], share: float) -> float | None:
    """The nearest rank; ``None`` of nothing."""
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)] if values else None


def freezes(pictures_at_s: Sequence[float], began_at_s: float, ended_at_s: float) -> int:
    """Gaps of more than :data:`FREEZE_S`, those at both ends included."""
    times = [began_at_s, *(at_s for at_s in pictures_at_s if began_at_s <= at_s <= ended_at_s), ended_at_s]
    return sum(after - before > FREEZE_S for before, after in pairwise(times))
