"""The table of bad networks, as it is pasted into bench/README.md."""

from __future__ import annotations

import math

from glass_bench.bad_links import Phase, Seen, table_lines
from glass_bench.figures import Displayed
from glass_bench.senders import Way


def seen(phase: Phase, well_again_s: float | None = None) -> Seen:
    pictures = [Displayed(step / 10, 0.05 if step else 0.5, 720) for step in range(100)]
    return Seen(phase, 0.0, 10.0, pictures, [(0.0, 0), (9.0, 9_000_000)], well_again_s)


def test_ways_stand_below_each_other_for_each_network() -> None:
    phases = [Phase("3 % loss"), Phase("falls to 1")]
    found = {Way("ours"): [seen(phases[0]), seen(phases[1], 1.25)],
             Way("other"): [seen(phases[0]), seen(phases[1], math.inf)]}  # fmt: skip
    head, rule, *rows = table_lines(found)
    assert head.count("|") == rule.count("|") == rows[0].count("|")
    assert rows == [
        "| 3 % loss | ours, VP8 | 0.0 | 10.0 | 50 / 50 / 500 | +0 |  | 8.00 | 720 |",
        "| 3 % loss | other, VP8 | 0.0 | 10.0 | 50 / 50 / 500 | +0 |  | 8.00 | 720 |",
        "| falls to 1 | ours, VP8 | 0.0 | 10.0 | 50 / 50 / 500 | +0 | 1.2 | 8.00 | 720 |",
        "| falls to 1 | other, VP8 | 0.0 | 10.0 | 50 / 50 / 500 | +0 | never | 8.00 | 720 |",
    ]
