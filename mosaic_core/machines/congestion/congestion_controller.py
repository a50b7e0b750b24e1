"""Declares the interface of whoever estimates how much one peer connection carries: from arrival times, or from
less."""

from __future__ import annotations

from typing import Protocol

from mosaic_core.machines.congestion.rate_control import Feedback


class CongestionController(Protocol):
    """Estimates what one peer connection may send; all of its streams are one to it. ``now_s``: any monotonic clock."""

    @property
    def budget_bps(self) -> int:
        """What all streams may send together."""

    @property
    def round_trip_s(self) -> float | None:
        """The last one that was reported."""

    @property
    def trains_bps(self) -> float | None:
        """How fast packets that left together came through lately: about what the narrowest link takes."""

    @property
    def paused_until_s(self) -> float:
        """Send nothing before: what is sent now waits behind a queue."""

    @property
    def usual_s(self) -> float:
        """How long packets wait on this path whatever is sent."""

    @property
    def is_queued(self) -> bool:
        """Packets wait on the way."""

    def most_bps(self, now_s: float) -> float:
        """What may be sent altogether, with copies."""

    def is_limited(self, now_s: float) -> bool:
        """The path takes no more than is sent."""

    def limit(self, min_bps: int, max_bps: int) -> None:
        """The streams changed: other limits hold."""

    def sent(self, size_bytes: int, now_s: float, *, is_key: bool = False) -> None: ...
    def handle(self, feedback: Feedback, now_s: float) -> None: ...
    def tick(self, now_s: float) -> None:
        """Call it about twice per second: silence is news too."""
