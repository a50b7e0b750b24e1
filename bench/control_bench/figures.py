"""Distributions: what was measured, against what was promised."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.table import Table


@dataclass(frozen=True, slots=True)
class Distribution:
    """Milliseconds of one thing under one load."""

    condition: str
    what: str
    values_ms: tuple[float, ...]
    promise: str = ""
    limit_ms: float | None = None
    """What the promise comes to here."""
    promised_share: float = 1.0
    """Of the values that shall keep the limit: 1 for all, 0.99 for the p99."""
    peer: Distribution | None = None

    def percentile_ms(self, share: float) -> float:
        """The nearest rank."""
        return sorted(self.values_ms)[max(1, math.ceil(share * len(self.values_ms))) - 1]

    @property
    def is_kept(self) -> bool | None:
        return None if self.limit_ms is None else self.percentile_ms(self.promised_share) <= self.limit_ms


@dataclass
class Report:
    """What was found so far."""

    found: list[Distribution] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, distribution: Distribution) -> Distribution:
        self.found.append(distribution)
        return distribution

    def table(self, title: str) -> Table:
        table = Table(title=title)
        for column in ("load", "what", "n", "p50", "p95", "p99", "max", "x peer", "promise", ""):
            table.add_column(column, justify="left" if column in ("load", "what", "promise", "") else "right")
        condition = ""
        for one in self.found:
            if condition and condition != one.condition:
                table.add_section()
            condition = one.condition
            table.add_row(*cells(one))
        return table

    @property
    def missed(self) -> Sequence[Distribution]:
        return [one for one in self.found if one.is_kept is False]


def cells(one: Distribution) -> list[str]:
    ranks = [f"{one.percentile_ms(share):.1f}" for share in (0.5, 0.95, 0.99, 1.0)]
    ratio = f"{one.percentile_ms(0.99) / one.peer.percentile_ms(0.99):.2f}" if one.peer else ""
    promise = f"{one.promise} = {one.limit_ms:.1f}" if one.limit_ms is not None else one.promise
    verdict = {None: "", True: "kept", False: "MISSED"}[one.is_kept]
    return [one.condition, one.what, str(len(one.values_ms)), *ranks, ratio, promise, verdict]
