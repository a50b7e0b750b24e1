"""The receiving half of the quicker SCTP that bounds what the other side makes us keep: parts of messages that never
end, packets behind a gap, channels, and names of channels. Who sends more loses the connection.

aiortc bounds nothing of it: what it announces as its window (RFC 9260 §3.3.2) holds for those who keep to it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator

from aiortc.rtcsctptransport import (
    DATA_CHANNEL_OPEN,
    SCTP_DATA_FIRST_FRAG,
    SCTP_DATA_LAST_FRAG,
    SCTP_TSN_MODULO,
    WEBRTC_DCEP,
    DataChunk,
    ForwardTsnChunk,
    InboundStream,
    RTCSctpTransport,
)

from mosaic_core.machines.delivery.shared_budget import Holding, SharedBudget

logger = logging.getLogger(__name__)

MAX_MESSAGE_BYTES = 256 * 1024
"""The largest message of SCTP: what aiortc announces as such (RFC 8841 §6.1). Ours come in smaller chunks."""
MAX_HELD_BYTES = 8 * 1024 * 1024
"""What may wait on one connection for a packet that was lost: all that a sender has on its way."""
ALL_HELD_BYTES = 64 * 1024 * 1024
"""The same for all connections of this process together."""
CHUNK_COST_BYTES = 400
"""What aiortc keeps of a packet beside its payload: who sends crumbs shall get no more memory than others."""
MAX_AHEAD = 16 * 1024
"""Packets so far ahead of the first that is missing are not taken: they are sent again. Each of those that are taken is
looked at with every packet that comes."""
MAX_CHANNELS = 512
"""A connector has one."""
MAX_OPEN_BYTES = 4096
"""The request for a channel: its name and protocol are a few words."""
ALL_HELD = SharedBudget(ALL_HELD_BYTES)


class BoundedReceiving(RTCSctpTransport):
    """Bounds what an SCTP association takes in, as a part of
    :class:`~mosaic_core.adapters.aiortc_private.sctp.quick_sctp.QuickSctp`. ``exceeded`` is told, once, why nothing
    more is taken.
    """

    exceeded: Callable[[str], None] | None = None
    _holding: Holding | None = None
    _takes_nothing = False

    @property
    def holding(self) -> Holding:
        """What this connection holds, as all others can see."""
        if self._holding is None:
            self._holding = Holding(ALL_HELD, lambda: self._refuse("all connections together hold too much"))
        return self._holding

    async def _receive_data_chunk(self, chunk: DataChunk) -> None:
        assert self._last_received_tsn is not None
        ahead = (chunk.tsn - self._last_received_tsn) % SCTP_TSN_MODULO
        if self._takes_nothing or MAX_AHEAD < ahead < SCTP_TSN_MODULO // 2:
            return
        await super()._receive_data_chunk(chunk)
        self._look_at(self._inbound_streams.get(chunk.stream_id))

    def _look_at(self, stream: InboundStream | None) -> None:
        if isinstance(stream, QuickInboundStream) and stream.message_bytes > MAX_MESSAGE_BYTES:
            self._refuse(f"a message has more than {MAX_MESSAGE_BYTES} bytes")
        elif self.holding.size_bytes > MAX_HELD_BYTES:
            self._refuse(f"what is not complete has more than {MAX_HELD_BYTES} bytes")

    async def _receive_forward_tsn_chunk(self, chunk: ForwardTsnChunk) -> None:
        if not self._takes_nothing:
            await super()._receive_forward_tsn_chunk(chunk)

    async def _data_channel_receive(self, stream_id: int, pp_id: int, data: bytes) -> None:
        if pp_id == WEBRTC_DCEP and data[:1] == bytes([DATA_CHANNEL_OPEN]):
            if len(self._data_channels) >= MAX_CHANNELS:
                self._refuse(f"it has more than {MAX_CHANNELS} channels")
            elif len(data) > MAX_OPEN_BYTES:
                self._refuse("the name of a channel is too long")
        if not self._takes_nothing:
            await super()._data_channel_receive(stream_id, pp_id, data)

    async def _reset_deferred_streams(self) -> None:
        before = dict(self._inbound_streams) if self._reconfig_deferred is not None else {}
        await super()._reset_deferred_streams()
        for stream_id, stream in before.items():
            if stream_id not in self._inbound_streams:
                self._forget(stream)

    def _get_inbound_stream(self, stream_id: int) -> InboundStream:
        stream = self._inbound_streams.get(stream_id)
        if stream is None:
            stream = self._inbound_streams[stream_id] = QuickInboundStream(self.holding)
        return stream

    def _set_state(self, state: RTCSctpTransport.State) -> None:
        super()._set_state(state)
        if state is self.State.CLOSED:
            self._forget_all()

    def _forget(self, stream: InboundStream) -> None:
        self._advertised_rwnd += sum(len(chunk.user_data) for chunk in stream.reassembly)
        stream.reassembly.clear()
        if isinstance(stream, QuickInboundStream):
            stream.settle()

    def _forget_all(self) -> None:
        for stream in self._inbound_streams.values():
            self._forget(stream)
        self._inbound_streams.clear()

    def _refuse(self, why: str) -> None:
        if self._takes_nothing:
            return
        self._takes_nothing = True
        self._forget_all()
        if self.exceeded is not None:
            self.exceeded(why)


class QuickInboundStream(InboundStream):
    """Reassembles the messages of one inbound stream, with its share of what the connection holds.

    aiortc looks through all that waits at every packet; one in the midst of a message completes nothing."""

    _completes_nothing = False

    def __init__(self, holding: Holding) -> None:
        super().__init__()
        self._holding = holding
        self._held_bytes = 0
        self.message_bytes = 0
        """Of the message that came last, as far as its parts came in order."""

    def add_chunk(self, chunk: DataChunk) -> None:
        super().add_chunk(chunk)
        is_last = self.reassembly[-1] is chunk
        self._completes_nothing = is_last and not chunk.flags & SCTP_DATA_LAST_FRAG
        if is_last:
            begins = chunk.flags & SCTP_DATA_FIRST_FRAG
            self.message_bytes = len(chunk.user_data) + (0 if begins else self.message_bytes)
        self._hold(self._held_bytes + _cost_bytes(chunk))

    def pop_messages(self) -> Iterator[tuple[int, int, bytes]]:
        if self._completes_nothing:
            return iter(())
        messages = list(super().pop_messages())
        self.settle()
        return iter(messages)

    def prune_chunks(self, tsn: int) -> int:
        pruned_bytes = super().prune_chunks(tsn)
        self.settle()
        return pruned_bytes

    def settle(self) -> None:
        """Count what is held now."""
        self._hold(sum(map(_cost_bytes, self.reassembly)))

    def _hold(self, size_bytes: int) -> None:
        more_bytes, self._held_bytes = size_bytes - self._held_bytes, size_bytes
        self._holding.add(more_bytes)


def _cost_bytes(chunk: DataChunk) -> int:
    return len(chunk.user_data) + CHUNK_COST_BYTES
