"""Loss, and a bottleneck that narrows and widens: what an operator sees of it, ours beside plain aiortc."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from glass_bench.figures import (
    Displayed,
    ages_ms,
    between,
    drift_ms,
    freezes_per_minute,
    mean_bps,
    rank,
    rate_reached_s,
    well_again_s,
)
from glass_bench.page import take_displayed
from glass_bench.senders import SenderProcess, Shot, Way
from glass_bench.sessions import Session, session
from mosaic_core.machines.laboratory.impaired_link import LinkProfile

SIZE = (1280, 720)
DELAY_MS, QUEUE_MS = 25.0, 500.0
WIDE_MBPS, NARROW_MBPS = 4.0, 1.0
SETTLE_S = 6.0
WELL_MS = 100.0
"""Above the age before the step: what an operator bears after it."""
RATE_SHARE = 0.8
"""Of the bit rate before the step: from then on it counts as regained."""


@dataclass(frozen=True, slots=True)
class Phase:
    """A state of the network; ``share`` of the time that a whole condition takes."""

    name: str
    loss: float = 0.0
    rate_mbps: float | None = None
    share: float = 1.0

    @property
    def profile(self) -> LinkProfile:
        return LinkProfile(self.name, delay_ms=DELAY_MS, loss=self.loss, rate_mbps=self.rate_mbps, queue_ms=QUEUE_MS)


CALM = Phase("no loss")
LOSSES = tuple(Phase(f"{share} % loss", loss=share / 100) for share in (1, 3, 8))
STEPS = (
    Phase(f"{WIDE_MBPS:g} Mbit/s", rate_mbps=WIDE_MBPS, share=0.3),
    Phase(f"falls to {NARROW_MBPS:g}", rate_mbps=NARROW_MBPS, share=0.8),
    Phase(f"rises to {WIDE_MBPS:g}", rate_mbps=WIDE_MBPS, share=0.8),
)


@dataclass
class Seen:
    """One phase."""

    phase: Phase
    from_s: float
    to_s: float
    pictures: list[Displayed] = field(default_factory=list)
    arrived: list[tuple[float, int]] = field(default_factory=list)
    well_again_s: float | None = None

    @property
    def freezes(self) -> float:
        return freezes_per_minute(self.pictures, self.from_s, self.to_s)

    def age_ms(self, share: float) -> float:
        return rank(ages_ms(self.pictures), share)

    @property
    def drift_ms(self) -> float:
        return drift_ms(self.pictures)

    @property
    def fps(self) -> float:
        return len(self.pictures) / (self.to_s - self.from_s)

    @property
    def mbps(self) -> float:
        return mean_bps(self.arrived, self.from_s, self.to_s) / 1e6

    @property
    def heights(self) -> str:
        """The heights that took at least a tenth of the time, the commonest first."""
        shown = [picture.height for picture in self.pictures]
        common = sorted(set(shown), key=shown.count, reverse=True)
        return " ".join(str(height) for height in common if shown.count(height) >= len(shown) / 10)


async def seen_by(browser: Any, ways: Sequence[Way], losses: Sequence[Phase], seconds: float) -> dict[Way, list[Seen]]:
    """Each loss for ``seconds`` on a connection of its own, then the step on another one; the ways take turns, so that
    what else the machine does hits both."""
    found: dict[Way, list[Seen]] = {way: [] for way in ways}
    for phase in losses:
        for way in ways:
            found[way].append(await _loss(browser, way, phase, seconds))
    for way in ways:
        found[way] += await _step(browser, way, seconds)
    return found


async def _loss(browser: Any, way: Way, phase: Phase, seconds: float) -> Seen:
    async with session(browser, None, Shot(way, SIZE, "scene", CALM.profile)) as one:
        await asyncio.sleep(SETTLE_S)
        return (await _phases(one, [phase], seconds))[0]


async def _step(browser: Any, way: Way, seconds: float) -> list[Seen]:
    async with session(browser, None, Shot(way, SIZE, "scene", STEPS[0].profile)) as one:
        await asyncio.sleep(SETTLE_S)
        wide, narrow, again = await _phases(one, STEPS, seconds)
        limit_ms = wide.age_ms(0.5) + WELL_MS
        narrow.well_again_s = well_again_s(narrow.pictures, narrow.from_s, narrow.to_s, limit_ms)
        again.well_again_s = rate_reached_s(again.arrived, again.from_s, RATE_SHARE * wide.mbps * 1e6)
        return [wide, narrow, again]


async def _phases(one: Session, phases: Sequence[Phase], seconds: float) -> list[Seen]:
    assert isinstance(one.sender, SenderProcess)
    seen = []
    await take_displayed(one.page, one.clock)
    await one.bytes_log()
    for phase in phases:
        began_s = time.monotonic()
        one.sender.become(phase.profile)
        await asyncio.sleep(seconds * phase.share)
        seen.append(Seen(phase, began_s, time.monotonic()))
    pictures, arrived = await take_displayed(one.page, one.clock), await one.bytes_log()
    for phase_seen in seen:
        phase_seen.pictures = between(pictures, phase_seen.from_s, phase_seen.to_s)
        phase_seen.arrived = [at for at in arrived if phase_seen.from_s <= at[0] < phase_seen.to_s]
    return seen


def table_lines(found: Mapping[Way, Sequence[Seen]]) -> list[str]:
    """In Markdown, the ways below each other."""
    names = (
        "network", "way", "freezes/min", "fps", "p50 / p95 / oldest ms", "drift ms", "well again s", "Mbit/s", "height",
    )  # fmt: skip
    lines = ["| " + " | ".join(names) + " |", "|---" * len(names) + "|"]
    for of_one_network in zip(*found.values(), strict=True):
        for way, seen in zip(found, of_one_network, strict=True):
            lines.append("| " + " | ".join((seen.phase.name, way.name, *_cells(seen))) + " |")
    return lines


def _cells(seen: Seen) -> tuple[str, ...]:
    return (
        f"{seen.freezes:.1f}",
        f"{seen.fps:.1f}",
        " / ".join(f"{seen.age_ms(share):.0f}" for share in (0.5, 0.95, 1.0)),
        f"{seen.drift_ms:+.0f}",
        "" if seen.well_again_s is None else f"{seen.well_again_s:.1f}".replace("inf", "never"),
        f"{seen.mbps:.2f}",
        seen.heights,
    )
