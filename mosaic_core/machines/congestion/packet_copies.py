"""Which packets are sent twice, unasked, because the path loses some: what is lost is there before it is missed.

On a path of 25 ms a packet that is asked for again comes 60 ms late, with all pictures after it, and if the repeat gets
lost too the picture stands. A copy costs its bits and nothing else, so copies are sent only beside what the path takes.
"""

from __future__ import annotations

from collections import deque

_FROM_LOSS, _TO_LOSS = 0.005, 0.002
"""Begin and end. Below it a loss every few seconds is not worth the bits."""
_DOUBLE_REPEATS_FROM = 0.002
_TO_BLAME = 0.15
"""So much is lost only where too much is sent: more would be lost with it."""
_WINDOW_S, _LEAST_PACKETS = 5.0, 60
_STEP = 0.2
"""More of the packets with each report, so that a path that doesn't take it is noticed before it hurts."""
_FIRST_HOLD_S, _LONGEST_HOLD_S = 5.0, 60.0
_BLAMELESS_S = 10.0
"""A queue that comes so long after copies began is not theirs: the next pause is a short one again."""
RESERVE_FROM, RESERVE = 0.02, 0.5
"""From this loss on, a path that is full to the brim gives so much of its rate to copies."""
_BURST_S = 0.25


class PacketCopies:
    """Decides which packets to one viewer are sent twice."""

    def __init__(self) -> None:
        self._reports: deque[tuple[float, int, int]] = deque()
        self._share = 0.0
        self._hold_until_s = 0.0
        self._hold_s = _FIRST_HOLD_S
        self._began_at_s = 0.0
        self._tokens_bytes = 0.0
        self._counted_at_s = 0.0
        self.loss = 0.0
        """Share of all packets that got lost lately."""

    @property
    def doubles_repeats(self) -> bool:
        """Whether a packet that was asked for is sent twice: it is late already."""
        return _DOUBLE_REPEATS_FROM <= self.loss < _TO_BLAME

    @property
    def are_sent(self) -> bool:
        """Whether there are any now."""
        return self._share > 0.0

    def picture_bps(self, budget_bps: int, *, is_limited: bool) -> int:
        """What of the budget is for pictures. ``is_limited``: the path takes no more than the budget."""
        return (
            round(budget_bps * (1.0 - RESERVE)) if is_limited and RESERVE_FROM <= self.loss < _TO_BLAME else budget_bps
        )

    def reported(self, lost: int, received: int, now_s: float, *, is_queued: bool) -> None:
        """What a report says. ``is_queued``: packets wait on the path, so more would make it worse."""
        self._note_loss(lost, received, now_s)
        if is_queued or self.loss > _TO_BLAME:
            if self._share > 0.0:
                hold_s = _FIRST_HOLD_S if now_s - self._began_at_s >= _BLAMELESS_S else self._hold_s
                self._hold_until_s = now_s + hold_s
                self._hold_s = min(_LONGEST_HOLD_S, 2 * hold_s)
            self._share = 0.0
        elif self.loss < _TO_LOSS:
            self._share = 0.0
        elif now_s >= self._hold_until_s and (self.loss >= _FROM_LOSS or self._share > 0.0):
            self._began_at_s = self._began_at_s if self._share > 0.0 else now_s
            self._share = min(1.0, self._share + _STEP)

    def wants(self, size_bytes: int, spare_bps: float, now_s: float) -> bool:
        """Whether the packet that was just sent is sent once more, out of ``spare_bps``."""
        rate_bytes = self._share * max(0.0, spare_bps) / 8
        earned_bytes = min(_BURST_S, max(0.0, now_s - self._counted_at_s)) * rate_bytes
        self._counted_at_s = now_s
        self._tokens_bytes = min(rate_bytes * _BURST_S, self._tokens_bytes + earned_bytes)
        if self._tokens_bytes < size_bytes:
            return False
        self._tokens_bytes -= size_bytes
        return True

    def _note_loss(self, lost: int, received: int, now_s: float) -> None:
        self._reports.append((now_s, lost, received))
        while self._reports[0][0] < now_s - _WINDOW_S:
            self._reports.popleft()
        all_lost = sum(one[1] for one in self._reports)
        packets = all_lost + sum(one[2] for one in self._reports)
        self.loss = all_lost / packets if packets >= _LEAST_PACKETS else 0.0
