"""Decides when the next packet of a picture leaves: a large picture is spread over some milliseconds instead of burst.

A key frame of 30 packets sent at once overruns the short queues of access points and modems, and each packet that is
lost costs a round trip. Ordinary pictures fit into the burst and are not delayed.
"""

from __future__ import annotations

MIN_BURST_BYTES = 6_500
BURST_S = 0.05
"""Of the bit rate: one and a half ordinary pictures go unpaced. Delaying each of them cost 15 ms in the browser."""
LEAST_BURST_BYTES, PATH_BURST_S = 3_900, 0.03
"""Of a path that is known: three packets tell how fast it is, more may overrun a short queue."""
DRAIN_FACTOR = 1.5
"""Of the viewer's bit rate, at least: what is sent just as fast as it is made never catches up."""
RATE_FACTOR = 4.0
"""Of the viewer's bit rate: a picture may take a quarter of the time until the next one."""
MIN_PACE_BPS = 3_000_000
LONGEST_WAIT_S = 0.02
COARSE_S = 0.001
"""Event loops wake in whole milliseconds."""


class PacketPacer:
    """Spreads the packets to one viewer over time."""

    def __init__(self) -> None:
        self._debt_bytes = 0.0
        self._counted_at_s = 0.0

    def wait_s(
        self, size_bytes: int, budget_bps: int, now_s: float, path_bps: float | None = None, waiting: int = 0
    ) -> float:
        """A packet has just left: seconds until the next one may. 0 while the burst lasts. ``path_bps``: what packets
        of earlier pictures were seen to come through at. Slower than that would only be later, and faster ones wait
        for each other anyway, or find the queue full. ``waiting``: pictures behind this one, which hurry it up."""
        if path_bps is None:
            rate_bytes = max(MIN_PACE_BPS, budget_bps * RATE_FACTOR) / 8
            burst_bytes = max(MIN_BURST_BYTES, budget_bps / 8 * BURST_S)
        else:
            rate_bytes = max(path_bps, budget_bps * DRAIN_FACTOR) / 8
            burst_bytes = max(LEAST_BURST_BYTES, min(MIN_BURST_BYTES, rate_bytes * PATH_BURST_S))
        rate_bytes *= 1 + waiting
        paid_bytes = max(0.0, now_s - self._counted_at_s) * rate_bytes
        self._debt_bytes = max(0.0, self._debt_bytes - paid_bytes) + size_bytes
        self._counted_at_s = now_s
        wait_s = (self._debt_bytes - burst_bytes) / rate_bytes
        return 0.0 if wait_s < COARSE_S else min(LONGEST_WAIT_S, wait_s)
