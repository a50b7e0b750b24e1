"""Runs checks side by side: each has its time-out, an exception is a finding, and whoever looks sees them come."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from dataclasses import dataclass

from mosaic_core.words.finding import Finding, failed, warned

CHECK_TIMEOUT_S = 18.0
"""For one check, which may have several steps of its own; the promise for all is 20 s."""


@dataclass(frozen=True, slots=True)
class CheckRun:
    """A check to run: its ``name`` is the group of its findings. ``is_heavy``: takes the processor, so runs by
    itself."""

    name: str
    start: Callable[[], AsyncIterator[Finding]]
    is_heavy: bool = False
    timeout_s: float = CHECK_TIMEOUT_S


@dataclass(frozen=True, slots=True)
class Examined:
    """All findings in the order of the checks."""

    findings: tuple[Finding, ...]
    took_s: float

    @property
    def has_failed(self) -> bool:
        return any(one.status == "fail" for one in self.findings)


class Progress:
    """Hears how an examination goes on; does nothing by itself."""

    def began(self, name: str) -> None:
        """A check starts."""

    def found(self, finding: Finding) -> None:
        """It found something."""

    def ended(self, name: str) -> None:
        """It is over."""


async def examined(checks: Sequence[CheckRun], progress: Progress | None = None) -> Examined:
    """Run all: light ones at the same time, heavy ones one after the other beside them."""
    telling, began_s = progress or Progress(), time.monotonic()
    found: dict[int, list[Finding]] = {}

    async def run(places: Iterable[int]) -> None:
        for place in places:
            found[place] = await _findings_of(checks[place], telling)

    heavy = [place for place, one in enumerate(checks) if one.is_heavy]
    light = [place for place, one in enumerate(checks) if not one.is_heavy]
    await asyncio.gather(run(heavy), *(run([place]) for place in light))
    ordered = tuple(finding for place in sorted(found) for finding in found[place])
    return Examined(ordered, time.monotonic() - began_s)


async def _findings_of(one: CheckRun, progress: Progress) -> list[Finding]:
    found: list[Finding] = []

    def add(finding: Finding) -> None:
        found.append(finding)
        progress.found(finding)

    progress.began(one.name)
    try:
        async with asyncio.timeout(one.timeout_s):
            async for finding in one.start():
                add(finding)
    except TimeoutError:
        add(warned(f"{one.name}.all", "check.timeout", f"The check took longer than {one.timeout_s:.0f} s."))
    except Exception as error:  # noqa: BLE001 - a check may be a plugin's, and fail in any way
        add(failed(f"{one.name}.all", "check.failed", f"The check failed: {type(error).__name__}: {error}"))
    progress.ended(one.name)
    return found
