"""The part of the quicker SCTP that says how much may be on its way: acknowledgements widen the window faster, and a
queue that stands on the way shrinks it before it overflows.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from aiortc.rtcsctptransport import USERDATA_MAX_LENGTH, SackChunk
from aiortc.utils import uint32_gte

from mosaic_core.adapters.aiortc_private.sctp.sctp_retransmitting import QuickRetransmitting
from mosaic_core.machines.congestion.background_rate import BackgroundRate
from mosaic_core.machines.congestion.standing_queue import BACKGROUND_TARGET_S, TARGET_S, StandingQueue

INITIAL_WINDOW_BYTES = 10 * USERDATA_MAX_LENGTH
"""As TCP's (RFC 6928 §2); the 4 380 bytes of RFC 9260 §7.2.1 are those of TCP in 2002."""
LEAST_WINDOW_BYTES = 8 * USERDATA_MAX_LENGTH
"""A long queue may be another's, who does not yield: so much is always on its way, as beside any loss-based flow."""
GROWTH_BYTES = 8 * USERDATA_MAX_LENGTH
"""Per acknowledgement in slow start: in a dense flow one often stands for so many packets (RFC 3465 §2.3)."""


class QuickWindow(QuickRetransmitting):
    """The middle part of the sending half of ``QuickSctp``, see ``quick_sctp.py``."""

    _standing_queue: StandingQueue | None = None
    background: BackgroundRate
    gives_way = False
    """Of two flows on one path the one with the shorter queue in mind goes on with what the other leaves. It also
    leaves the event loop some time."""
    data_left: Callable[[int], None] | None = None
    """Is told the size of every packet of new data that does not give way."""

    async def _receive_sack_chunk(self, chunk: SackChunk) -> None:
        self._may_retransmit = self._may_retransmit or bool(chunk.gaps)
        acknowledged_bytes = self._newly_acknowledged_bytes(chunk.cumulative_tsn)
        earliest = self._sent_queue[0] if self._sent_queue else None
        if earliest is not None and earliest._sent_count == 1 and uint32_gte(chunk.cumulative_tsn, earliest.tsn):
            assert earliest._sent_time is not None
            self._round_trip_s = time.monotonic() - earliest._sent_time
            self._watch_queue(self._round_trip_s)
        window_bytes = self._cwnd
        await super()._receive_sack_chunk(chunk)
        step_bytes = min(acknowledged_bytes, USERDATA_MAX_LENGTH)
        if step_bytes and window_bytes <= self._ssthresh and self._cwnd == window_bytes + step_bytes:
            self._cwnd += min(acknowledged_bytes, GROWTH_BYTES) - step_bytes

    def _watch_queue(self, round_trip_s: float) -> None:
        """Shrink the window before the queue on the way gets long, not when it overflows."""
        if self._standing_queue is None:
            self._standing_queue = StandingQueue()
        self._standing_queue.target_s = BACKGROUND_TARGET_S if self.gives_way else TARGET_S
        is_full = self._flight_size >= self._cwnd
        share = self._standing_queue.heard(round_trip_s, time.monotonic(), is_full=is_full)
        if share is not None and self._fast_recovery_exit is None:
            self._cwnd = self._ssthresh = max(round(self._cwnd * share), LEAST_WINDOW_BYTES)
            self._partial_bytes_acked = 0

    def _newly_acknowledged_bytes(self, cumulative_tsn: int) -> int:
        total = 0
        for chunk in self._sent_queue:
            if not uint32_gte(cumulative_tsn, chunk.tsn) or total >= GROWTH_BYTES:
                break
            total += 0 if chunk._acked else chunk._book_size
        return total
