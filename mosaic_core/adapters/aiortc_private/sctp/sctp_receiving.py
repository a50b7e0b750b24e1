"""The receiving half of the quicker SCTP: fewer acknowledgements, and none that waits long."""

from __future__ import annotations

import asyncio

from aiortc.rtcsctptransport import ForwardTsnChunk, tsn_plus_one
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.sctp.sctp_bounds import BoundedReceiving
from mosaic_core.machines.congestion.ack_pace import LEAST, AckPace

ACK_DELAY_S = 0.02
"""RFC 9260 §6.2 allows 0.5 s; a sender with a window of few packets would wait for us."""
DENSE_S = 0.001
"""Packets that come faster than two in this time are acknowledged many at a time: half of all work would be
acknowledgements else. A sender counts bytes, not acknowledgements (RFC 9260 §7.2.1)."""
REST_DELAY_S = 0.002
"""For the rest of such a row, when it ends before the acknowledgement is due."""


class QuickReceiving(BoundedReceiving):
    """Half of :class:`~mosaic_core.adapters.aiortc_private.sctp.quick_sctp.QuickSctp`."""

    _ack_pace: AckPace | None = None
    _unacknowledged_packets = 0
    _must_acknowledge = False
    _acknowledged_at_s = 0.0
    _sack_handle: asyncio.TimerHandle | None = None
    _sack_task: asyncio.Future[None] | None = None

    async def _send_sack(self) -> None:
        """aiortc wants to acknowledge a packet: some later one, or at once when something is out of order."""
        self._unacknowledged_packets += 1
        count, loop = self._unacknowledged_packets, asyncio.get_running_loop()
        self._ack_pace = pace = self._ack_pace or AckPace()
        if self._must_acknowledge or self._sack_misordered or self._sack_duplicates:
            await self._acknowledge()
            return
        is_dense = loop.time() - self._acknowledged_at_s < DENSE_S
        if count >= (pace.packets if is_dense else LEAST):
            if is_dense:
                pace.kept_up()
            await self._acknowledge()
            return
        self._sack_needed = False
        if self._sack_handle is not None and count == LEAST:
            self._sack_handle.cancel()
            self._sack_handle = None
        if self._sack_handle is None:
            delay_s = REST_DELAY_S if count >= LEAST else ACK_DELAY_S
            self._sack_handle = loop.call_later(delay_s, self._acknowledgement_due)

    async def _acknowledge(self) -> None:
        self._unacknowledged_packets, self._must_acknowledge = 0, False
        self._acknowledged_at_s = asyncio.get_running_loop().time()
        await super()._send_sack()

    def _acknowledgement_due(self) -> None:
        self._sack_handle = None
        if self._ack_pace is not None and self._unacknowledged_packets >= LEAST:
            self._ack_pace.stalled(self._unacknowledged_packets)
        if self._unacknowledged_packets and self._association_state is self.State.ESTABLISHED:
            self._sack_task = asyncio.ensure_future(self._acknowledge_late())

    async def _acknowledge_late(self) -> None:
        try:
            await self._acknowledge()
        except (ConnectionError, SSL.Error):
            return  # the transport below has closed meanwhile, or is just closing; there is nobody to tell

    async def _receive_forward_tsn_chunk(self, chunk: ForwardTsnChunk) -> None:
        self._must_acknowledge = True  # RFC 3758 §3.6: the sender repeats it until it is acknowledged
        await super()._receive_forward_tsn_chunk(chunk)

    def _mark_received(self, tsn: int) -> bool:
        assert self._last_received_tsn is not None
        if tsn == tsn_plus_one(self._last_received_tsn) and not self._sack_misordered and not self._sack_duplicates:
            self._last_received_tsn = tsn
            return False
        return super()._mark_received(tsn)
