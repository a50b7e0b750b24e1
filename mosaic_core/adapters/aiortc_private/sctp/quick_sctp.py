"""SCTP with what aiortc leaves out: bundled messages, delayed acknowledgements, a wider window, larger bursts.

Half of the time that a data channel costs under load goes into acknowledgements, one per packet. Everything here stays
inside RFC 9260 and changes no byte of the format, so the other side may be anybody.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from aiortc.rtcsctptransport import ForwardTsnChunk, RTCSctpTransport, tsn_plus_one
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.sctp.sctp import MeasuredQueue
from mosaic_core.adapters.aiortc_private.sctp.sctp_bounds import BoundedReceiving
from mosaic_core.adapters.aiortc_private.sctp.sctp_retransmitting import INITIAL_RTO_S
from mosaic_core.adapters.aiortc_private.sctp.sctp_sending import QuickSending
from mosaic_core.adapters.aiortc_private.sctp.sctp_window import INITIAL_WINDOW_BYTES
from mosaic_core.machines.congestion.ack_pace import LEAST, AckPace
from mosaic_core.machines.congestion.background_rate import BackgroundRate

ACK_DELAY_S = 0.02
"""RFC 9260 §6.2 allows 0.5 s; a sender with a window of few packets would wait for us."""
DENSE_S = 0.001
"""Packets that come faster than two in this time are acknowledged many at a time: half of all work would be
acknowledgements else. A sender counts bytes, not acknowledgements (RFC 9260 §7.2.1)."""
REST_DELAY_S = 0.002
"""For the rest of such a row, when it ends before the acknowledgement is due."""


class QuickReceiving(BoundedReceiving):
    """Receives the data of an SCTP association: the half of
    :class:`~mosaic_core.adapters.aiortc_private.sctp.quick_sctp.QuickSctp` that takes chunks in.
    """

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


class QuickSctp(QuickSending, QuickReceiving):
    """The SCTP transport of a peer connection, quickened. Never constructed: :func:`quicken` turns a peer connection's
    own transport into one before it starts.
    """


def quicken(sctp: RTCSctpTransport, exceeded: Callable[[str], None] | None = None) -> None:
    """Turn ``sctp`` into a :class:`QuickSctp`; before the peer connection starts it, doing so twice does nothing.

    ``exceeded`` is told why nothing more is taken, when the other side sends more than the bounds allow."""
    if type(sctp) is not RTCSctpTransport:
        return
    sctp.__class__ = QuickSctp
    assert isinstance(sctp, QuickSctp)
    sctp.exceeded = exceeded
    sctp.background = BackgroundRate()
    sctp._cwnd = INITIAL_WINDOW_BYTES
    sctp._rto = INITIAL_RTO_S
    waiting, sctp._data_channel_queue = sctp._data_channel_queue, MeasuredQueue(lambda entry: len(entry[2]))
    for entry in waiting:
        sctp._data_channel_queue.append(entry)
    sctp._outbound_queue = MeasuredQueue(lambda chunk: len(chunk.user_data))
