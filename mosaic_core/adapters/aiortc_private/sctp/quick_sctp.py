"""SCTP with what aiortc leaves out: bundled messages, delayed acknowledgements, a wider window, larger bursts.

Half of the time that a data channel costs under load goes into acknowledgements, one per packet. Everything here stays
inside RFC 9260 and changes no byte of the format, so the other side may be anybody.
"""

from __future__ import annotations

from collections.abc import Callable

from aiortc.rtcsctptransport import RTCSctpTransport

from mosaic_core.adapters.aiortc_private.sctp.sctp import MeasuredQueue
from mosaic_core.adapters.aiortc_private.sctp.sctp_receiving import QuickReceiving
from mosaic_core.adapters.aiortc_private.sctp.sctp_retransmitting import INITIAL_RTO_S
from mosaic_core.adapters.aiortc_private.sctp.sctp_sending import QuickSending
from mosaic_core.adapters.aiortc_private.sctp.sctp_window import INITIAL_WINDOW_BYTES


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
    sctp._cwnd = INITIAL_WINDOW_BYTES
    sctp._rto = INITIAL_RTO_S
    waiting, sctp._data_channel_queue = sctp._data_channel_queue, MeasuredQueue(lambda entry: len(entry[2]))
    for entry in waiting:
        sctp._data_channel_queue.append(entry)
    sctp._outbound_queue = MeasuredQueue(lambda chunk: len(chunk.user_data))
