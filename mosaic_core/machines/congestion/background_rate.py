"""Sets the rate of what may wait beside the pictures of one connection: less as soon as a queue begins, before the
pictures have to give up anything, and little by little more while there is none.
"""

from __future__ import annotations

import math

from mosaic_core.machines.congestion.path_watch import PathSeen

START_BPS = 500_000.0
LEAST_BPS = 24_000.0
"""It never starves: somebody waits for it."""
MOST_BPS = 50_000_000.0
"""Beyond that nothing limits it."""
BURST_BYTES = 1_200
"""A packet at a time, where it is limited: two of them are a queue of 20 ms on 1 Mbit/s."""
SILENT_S = 2.0
"""Nobody looks at pictures any more."""
_QUEUE_S, _LONG_S = 0.008, 0.1
"""More than pictures wait for each other; and a queue beside which only the least is sent."""
_CUT, _CUT_EVERY_S = 0.6, 0.12
"""Each cut has its effect first."""
_GROWTH, _BOLD_GROWTH, _CAREFUL_S = 1.25, 4.0, 5.0
"""Per second; the first one for so long after a cut."""
_USED = 0.5
"""While less of it is sent, nothing is proved."""
_BURST_S = 0.005


class BackgroundRate:
    """Finds the bit rate of what gives way to pictures. ``now_s``: any monotonic clock."""

    def __init__(self) -> None:
        self._bps = START_BPS
        self._cut_at_s = self._heard_at_s = self._free_at_s = -math.inf
        self._sent_bytes = 0

    def reported(self, seen: PathSeen, usual_s: float, now_s: float) -> bool:
        """Whether it answers for the queue that a report on the pictures tells of: they need not be smaller then.
        ``usual_s``: how long packets always wait on this path."""
        elapsed_s, self._heard_at_s = now_s - self._heard_at_s, now_s
        if elapsed_s > SILENT_S:
            self._bps, self._sent_bytes, self._free_at_s = START_BPS, 0, now_s
            return False
        sent_bps, self._sent_bytes = self._sent_bytes * 8 / max(1e-3, elapsed_s), 0
        queue_s = seen.queue_s - usual_s
        if queue_s > _QUEUE_S:
            return self._gives_way(sent_bps, queue_s, now_s)
        if sent_bps >= _USED * min(self._bps, MOST_BPS):
            growth = _GROWTH if now_s - self._cut_at_s < _CAREFUL_S else _BOLD_GROWTH
            self._bps = min(2 * MOST_BPS, self._bps * growth**elapsed_s)
        return False

    def _gives_way(self, sent_bps: float, queue_s: float, now_s: float) -> bool:
        if now_s - self._cut_at_s < _CUT_EVERY_S:
            return True
        if sent_bps <= LEAST_BPS or self._bps <= LEAST_BPS:
            return False
        self._cut_at_s = now_s
        self._bps = LEAST_BPS if queue_s > _LONG_S else max(LEAST_BPS, _CUT * min(self._bps, sent_bps))
        return True

    # -- what is sent --------------------------------------------------------------------------------------------

    def is_limited(self, now_s: float) -> bool:
        return self._bps < MOST_BPS and now_s - self._heard_at_s <= SILENT_S

    @property
    def burst_bytes(self) -> float:
        """So much may be sent at a time, where it is limited."""
        return max(BURST_BYTES, self._bps / 8 * _BURST_S)

    def wait_s(self, now_s: float) -> float:
        """Seconds until more may be sent; 0: now."""
        return max(0.0, self._free_at_s - now_s) if self.is_limited(now_s) else 0.0

    def sent(self, size_bytes: int, now_s: float) -> None:
        self._sent_bytes += size_bytes
        if self.is_limited(now_s):
            self._free_at_s = max(self._free_at_s, now_s) + size_bytes * 8 / self._bps
