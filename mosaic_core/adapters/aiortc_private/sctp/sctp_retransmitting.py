"""The part of the quicker SCTP that sends lost packets again: a timer that is moved on paper, and round trips on the
monotonic clock.
"""

from __future__ import annotations

import asyncio

from aiortc.rtcsctptransport import SCTP_RTO_ALPHA, SCTP_RTO_BETA, SCTP_RTO_MAX, RTCSctpTransport

INITIAL_RTO_S = 1.0
"""RFC 9260 §16; aiortc waits for three seconds when the first packet of an association is lost."""
LEAST_RTO_S = 0.4
"""Chromium's. The one second of RFC 9260 §16 is a long time when the last message of a burst is lost."""
_TIMER_SLACK_S = 0.001


class QuickRetransmitting(RTCSctpTransport):
    """The lowest part of the sending half of ``QuickSctp``, see ``quick_sctp.py``."""

    _may_retransmit = False
    """Some chunk may be marked as lost: else nobody looks through all that is on its way."""
    _t3_due_s = 0.0
    _round_trip_s: float | None = None
    """The newest, until :meth:`_update_rto` takes it."""

    async def _retransmit(self, window_bytes: int) -> bool:
        """Send lost chunks again; ``False`` when the window is full before that is done."""
        is_earliest = True
        for chunk in list(self._sent_queue):
            if chunk._retransmit:
                if self._fast_recovery_transmit:
                    self._fast_recovery_transmit = False
                elif self._flight_size >= window_bytes:
                    return False
                self._flight_size_increase(chunk)
                chunk._misses = 0
                chunk._retransmit = False
                chunk._sent_count += 1
                await self._send_chunk(chunk)
                if is_earliest:
                    self._t3_restart()
            is_earliest = False
        self._may_retransmit = False
        return True

    def _update_rto(self, R: float) -> None:
        """RFC 9260 §6.3.1. ``R`` is aiortc's, of the wall clock: a clock that is set would stop retransmissions."""
        trip_s, self._round_trip_s = self._round_trip_s, None
        if trip_s is None:
            return
        if self._srtt is None or self._rttvar is None:
            self._srtt, self._rttvar = trip_s, trip_s / 2
        else:
            self._rttvar += SCTP_RTO_BETA * (abs(self._srtt - trip_s) - self._rttvar)
            self._srtt += SCTP_RTO_ALPHA * (trip_s - self._srtt)
        self._rto = max(LEAST_RTO_S, min(self._srtt + 4 * self._rttvar, SCTP_RTO_MAX))

    # -- the timer is moved on paper: a timer of the loop per acknowledgement is dear ---------------------------------

    def _ensure_t3(self) -> None:
        if not self._t3_handle:
            self._t3_start()

    def _t3_start(self) -> None:
        self._t3_due_s = asyncio.get_running_loop().time() + self._rto
        super()._t3_start()

    def _t3_restart(self) -> None:
        due_s = asyncio.get_running_loop().time() + self._rto
        if self._t3_handle is None or self._t3_handle.when() > due_s:
            super()._t3_restart()
        self._t3_due_s = due_s

    def _t3_expired(self) -> None:
        left_s = self._t3_due_s - asyncio.get_running_loop().time()
        if left_s > _TIMER_SLACK_S:
            self._t3_handle = asyncio.get_running_loop().call_later(left_s, self._t3_expired)
            return
        self._may_retransmit = True
        super()._t3_expired()
