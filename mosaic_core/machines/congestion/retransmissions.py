"""Which lost packets are sent again. Receivers ask for the same packet every few milliseconds; answering each time
filled a congested link with five times the bit rate of the picture, for seconds.
"""

from __future__ import annotations

from collections import OrderedDict

SHARE = 0.3
"""Of the viewer's bit rate goes into repeats at most; beyond it a key frame is cheaper."""
BURST_S = 0.15
LEAST_INTERVAL_S = 0.02
_UNKNOWN_ROUND_TRIP_S = 0.1
_PATIENCE = 0.6
"""Of a round trip. Who asks again after a whole one has lost the repeat too; refusing him for a millisecond that is
missing would cost another round trip, and that is a freeze."""
_REMEMBERED = 256
_MAX_PACKET_BYTES = 1400


class Retransmissions:
    """Decides which packets are sent to one viewer again."""

    def __init__(self) -> None:
        self._repeated_at_s: OrderedDict[int, float] = OrderedDict()
        self._tokens_bytes: float | None = None
        self._counted_at_s = 0.0
        self.is_exhausted = False
        """The last refusal was for want of bit rate: that packet will never arrive."""

    def note(self, sequence_number: int, now_s: float) -> None:
        """A copy was sent unasked: whoever asks now had not seen it yet."""
        self._repeated_at_s[sequence_number] = now_s
        self._repeated_at_s.move_to_end(sequence_number)
        if len(self._repeated_at_s) > _REMEMBERED:
            self._repeated_at_s.popitem(last=False)

    def may(self, sequence_number: int, budget_bps: int, round_trip_s: float | None, now_s: float) -> bool:
        """Whether this packet is sent again now."""
        self.is_exhausted = False
        round_trip_s = _UNKNOWN_ROUND_TRIP_S if round_trip_s is None else round_trip_s
        interval_s = max(LEAST_INTERVAL_S, _PATIENCE * round_trip_s)
        if now_s - self._repeated_at_s.get(sequence_number, float("-inf")) < interval_s:
            return False  # the first repeat may still be on its way
        if self._refilled(budget_bps, now_s) < _MAX_PACKET_BYTES:
            self.is_exhausted = True
            return False
        self._tokens_bytes = (self._tokens_bytes or 0.0) - _MAX_PACKET_BYTES
        self.note(sequence_number, now_s)
        return True

    def _refilled(self, budget_bps: int, now_s: float) -> float:
        rate_bytes = budget_bps * SHARE / 8
        full_bytes = max(4.0 * _MAX_PACKET_BYTES, rate_bytes * BURST_S)
        if self._tokens_bytes is None:
            self._tokens_bytes = full_bytes
        earned_bytes = max(0.0, now_s - self._counted_at_s) * rate_bytes
        self._tokens_bytes = min(full_bytes, self._tokens_bytes + earned_bytes)
        self._counted_at_s = now_s
        return self._tokens_bytes
