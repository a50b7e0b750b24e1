"""The sending half of the quicker SCTP: one flush for all messages that wait, several messages in a packet, larger
bursts.
"""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from struct import pack

from aiortc import RTCDataChannel
from aiortc.rtcsctptransport import (
    SCTP_COMMON_HEADER_LENGTH,
    SCTP_MAX_PACKET_LENGTH,
    USERDATA_MAX_LENGTH,
    WEBRTC_BINARY,
    WEBRTC_BINARY_EMPTY,
    WEBRTC_DCEP,
    WEBRTC_STRING,
    WEBRTC_STRING_EMPTY,
    DataChunk,
)
from google_crc32c import value as crc32c
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.sctp.sctp import MeasuredQueue
from mosaic_core.adapters.aiortc_private.sctp.sctp_window import QuickWindow
from mosaic_core.machines.timing.pacing import TimeShare

BURST_BYTES = 16 * USERDATA_MAX_LENGTH
"""RFC 9260 §6.1 D asks for a limit and leaves it to us."""
BATCH_S = 0.002
"""What a fast path takes in this time is sent together: two packets per acknowledgement would wake both ends for each
two, which costs half as much again. A slow path takes less than a packet in this time: there each one goes at once."""
BACKGROUND_SHARE, BACKGROUND_CREDIT_S = 0.3, 0.0005
"""Of the event loop's time, for sending what gives way: commands and pictures find it free
(``bench/command_beside_bulk.py``)."""
RECOVERY_BURST_BYTES = 2 * USERDATA_MAX_LENGTH
_BUNDLE_BYTES = SCTP_MAX_PACKET_LENGTH - SCTP_COMMON_HEADER_LENGTH


class QuickSending(QuickWindow):
    """Sends the data of an SCTP association: the half of
    :class:`~mosaic_core.adapters.aiortc_private.sctp.quick_sctp.QuickSctp` that lets chunks out.
    """

    _is_gathering = False
    _is_flush_due = False
    _flush_task: asyncio.Future[None] | None = None
    _time_share: TimeShare | None = None
    _share_handle: asyncio.TimerHandle | None = None

    # -- from messages to chunks -------------------------------------------------------------------------------------

    def _data_channel_send(self, channel: RTCDataChannel, data: bytes | str) -> None:
        """aiortc makes a task for every message; here one flush takes all that were sent meanwhile."""
        protocol, user_data = _payload(data)
        limit_bytes = self._remote_max_message_size
        if limit_bytes and len(user_data) > limit_bytes:
            raise ValueError(f"{len(user_data)} bytes are too many: the other side takes messages of {limit_bytes}")
        channel._addBufferedAmount(len(user_data))
        self._data_channel_queue.append((channel, protocol, user_data))
        if not self._is_flush_due:
            self._is_flush_due = True
            self._flush_task = asyncio.ensure_future(self._data_channel_flush())

    async def _data_channel_flush(self) -> None:
        """Cut as many messages into chunks as a burst takes, then send them: aiortc sends each by itself."""
        self._is_flush_due = False
        if self._association_state is not self.State.ESTABLISHED or self._is_gathering or not self._data_channel_queue:
            return
        self._is_gathering = True
        try:
            chunks: MeasuredQueue[DataChunk] = self._outbound_queue  # type: ignore[assignment] # quicken() made it one
            while self._data_channel_queue and chunks.size_bytes < BURST_BYTES:
                await self._cut_next_message()
        finally:
            self._is_gathering = False
        await self._transmit()
        await self._transmit_reconfig()

    async def _cut_next_message(self) -> None:
        channel, protocol, user_data = self._data_channel_queue.popleft()
        stream_id = self._numbered(channel) if channel.id is None else channel.id
        if protocol == WEBRTC_DCEP:
            await self._send(stream_id, protocol, user_data)
            return
        lifetime_ms = channel.maxPacketLifeTime
        expiry = time.time() + lifetime_ms / 1000 if lifetime_ms else None  # aiortc compares with its wall clock
        retransmits = channel.maxRetransmits
        await self._send(stream_id, protocol, user_data, expiry, retransmits, channel.ordered)
        channel._addBufferedAmount(-len(user_data))

    def _numbered(self, channel: RTCDataChannel) -> int:
        """Give it the next free stream of our side (RFC 8832 §6: even ones for the DTLS client, odd ones else)."""
        stream_id = self._data_channel_id
        assert stream_id is not None  # known since the association began
        while stream_id in self._data_channels:
            stream_id += 2
        self._data_channels[stream_id] = channel
        channel._setId(stream_id)
        return stream_id

    # -- from chunks to packets --------------------------------------------------------------------------------------

    async def _transmit(self) -> None:
        if self._is_gathering:
            return
        with suppress(ConnectionError, SSL.Error):  # DTLS has ended, or is just ending: there is nobody to send to
            await self._transmit_what_may_go()

    async def _transmit_what_may_go(self) -> None:
        if self._forward_tsn_chunk is not None:
            await self._send_chunk(self._forward_tsn_chunk)
            self._forward_tsn_chunk = None
            self._ensure_t3()
        burst_bytes = BURST_BYTES if self._fast_recovery_exit is None else RECOVERY_BURST_BYTES
        window_bytes = min(self._flight_size + burst_bytes, self._cwnd)
        if self._may_retransmit and not await self._retransmit(window_bytes):
            return
        if self._outbound_queue and self._flight_size < window_bytes and not self._waits_for_more_room():
            if self.gives_way:
                await self._send_new_in_its_time(window_bytes)
            else:
                await self._send_new(window_bytes)

    def _waits_for_more_room(self) -> bool:
        """The next acknowledgement makes a larger batch; enough is on its way until then."""
        if not self._srtt or self._fast_recovery_exit is not None:
            return False
        waiting: MeasuredQueue[DataChunk] = self._outbound_queue  # type: ignore[assignment] # quicken() made it one
        batch_bytes = min(BURST_BYTES, self._cwnd / self._srtt * BATCH_S)
        room_bytes = self._cwnd - self._flight_size
        return self._flight_size >= 2 * batch_bytes and room_bytes < min(batch_bytes, waiting.size_bytes)

    async def _send_new_in_its_time(self, window_bytes: int) -> None:
        """What gives way: at its rate, as long as the event loop has time for it."""
        if self._time_share is None:
            self._time_share = TimeShare(BACKGROUND_SHARE, BACKGROUND_CREDIT_S)
        began_s = time.monotonic()
        wait_s = max(self._time_share.wait_s(began_s), self.background.wait_s(began_s))
        if wait_s == 0:
            wait_s = await self._send_background(self._time_share, window_bytes, began_s)
        if wait_s > 0 and self._share_handle is None:
            self._share_handle = asyncio.get_running_loop().call_later(wait_s, self._time_has_come)

    async def _send_background(self, share: TimeShare, window_bytes: int, began_s: float) -> float:
        """Seconds until more may be sent, if nothing else says when: an acknowledgement may be long in coming."""
        before_bytes = self._flight_size
        if self.background.is_limited(began_s):
            window_bytes = min(window_bytes, before_bytes + round(self.background.burst_bytes))
        await self._send_new(window_bytes)
        share.took(began_s, time.monotonic())
        self.background.sent(self._flight_size - before_bytes, began_s)
        return self.background.wait_s(began_s)

    def _time_has_come(self) -> None:
        self._share_handle = None
        if self._association_state is self.State.ESTABLISHED:
            self._flush_task = asyncio.ensure_future(self._transmit())

    async def _send_new(self, window_bytes: int) -> None:
        now_s = time.monotonic()
        bundle: list[bytes] = []
        room_bytes = _BUNDLE_BYTES
        while self._outbound_queue and self._flight_size < window_bytes:
            chunk = self._outbound_queue.popleft()
            self._sent_queue.append(chunk)
            self._flight_size_increase(chunk)
            chunk._sent_count += 1
            chunk._sent_time = now_s
            data = bytes(chunk)
            if len(data) > room_bytes:
                await self._send_bundle(bundle)
                bundle, room_bytes = [], _BUNDLE_BYTES
            bundle.append(data)
            room_bytes -= len(data)
        await self._send_bundle(bundle)
        self._ensure_t3()

    async def _send_bundle(self, chunks: list[bytes]) -> None:
        """Send one packet; aiortc itself knows only packets of one chunk."""
        header = pack("!HHL", self._local_port, self._remote_port, self._remote_verification_tag)
        data = b"".join(chunks)
        checksum = pack("<L", crc32c(header + bytes(4) + data))
        await self.transport._send_data(header + checksum + data)
        if self.data_left is not None and not self.gives_way:
            self.data_left(len(header) + len(checksum) + len(data))


def _payload(data: bytes | str) -> tuple[int, bytes]:
    """The protocol number of RFC 8831 §8 and what travels: SCTP knows no empty message."""
    if isinstance(data, str):
        return (WEBRTC_STRING, data.encode()) if data else (WEBRTC_STRING_EMPTY, b"\0")
    return (WEBRTC_BINARY, data) if data else (WEBRTC_BINARY_EMPTY, b"\0")
