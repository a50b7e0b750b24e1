"""Measures how fast a path is, from a bounded amount of data: robots that run share it with others, and may pay by the
byte.

What is under way doubles with every round trip, as TCP's does, and never is more than the path takes in half a second:
the pings that keep the connection alive are behind it.
"""

from __future__ import annotations

PIECE_BYTES = 4 * 1024
TOTAL_BYTES = 1536 * 1024
TRIAL_S = 1.6
FIRST_BYTES = 2 * PIECE_BYTES
MOST_UNDER_WAY_BYTES = 256 * 1024
QUEUE_S = 0.5
"""A quarter of the silence after which a connection counts as lost (``words.control.PEER_LOST_AFTER_S``)."""
_RAMP_SHARE = 1 / 3
"""Of what arrived: while the amount under way was still growing, it told nothing of the path."""
_NEARLY = 0.7


class PathTrial:
    """Measures the rate of a path in one trial. Time is any monotonic clock, in seconds."""

    def __init__(self, began_s: float) -> None:
        self._began_s = began_s
        self._arrivals: list[tuple[float, int]] = [(began_s, 0)]
        self.sent_bytes = 0

    @property
    def arrived_bytes(self) -> int:
        return self._arrivals[-1][1]

    def has_room(self, now_s: float) -> bool:
        """Whether another piece may go out."""
        left = TOTAL_BYTES - self.sent_bytes
        under_way = self.sent_bytes - self.arrived_bytes
        return left >= PIECE_BYTES and under_way + PIECE_BYTES <= self._window_bytes(now_s)

    def arrived(self, total_bytes: int, now_s: float) -> None:
        """So much has arrived since the trial began; less than before is not believed."""
        if total_bytes > self.arrived_bytes:
            self._arrivals.append((now_s, total_bytes))

    def is_over(self, now_s: float) -> bool:
        return now_s - self._began_s >= TRIAL_S or self.arrived_bytes > TOTAL_BYTES - PIECE_BYTES

    def throughput_bps(self) -> float:
        """Of the part after the ramp, or of all where that is too little; 0 if nothing arrived."""
        at_s, total = self._arrivals[-1]
        ramp_bytes = total * _RAMP_SHARE
        from_s, before = next(((at, got) for at, got in self._arrivals if got >= ramp_bytes), self._arrivals[0])
        if at_s - from_s < 0.001:
            from_s, before = self._arrivals[0]
        return (total - before) * 8 / max(0.001, at_s - from_s)

    def is_least(self, round_trip_s: float) -> bool:
        """Whether the round trip held it back and not the path: then the path takes at least this."""
        window_bytes = self._window_bytes(self._arrivals[-1][0])
        return self.throughput_bps() >= _NEARLY * window_bytes * 8 / max(1e-6, round_trip_s)

    def _window_bytes(self, now_s: float) -> float:
        """Twice what was under way a round trip ago, for all of that has arrived since."""
        elapsed_s = max(0.001, now_s - self._began_s)
        queue_bytes = self.arrived_bytes * min(1.0, QUEUE_S / elapsed_s)
        return max(FIRST_BYTES, min(MOST_UNDER_WAY_BYTES, queue_bytes))
