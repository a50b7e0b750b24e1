"""Spreads the packets of large pictures, and sends some twice: aiortc sends all packets of a picture in one go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from aiortc import RTCRtpSender
from aiortc.rtp import is_rtcp

from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.transport.media_transport import PictureFeed

COPY_AFTER_S = 0.01
"""After the picture: a short burst of losses may be over by then, and a repeat on request comes much later."""
_COPIES_AT_ONCE = 4
_COPY_PAUSE_S = 0.002
_MARKER = 0x80


class WatchedTransport:
    """Stands between a sender and its DTLS transport. ``left(data)`` is told of every RTP packet."""

    def __init__(self, sender: RTCRtpSender, left: Callable[[bytes], None]) -> None:
        self._transport = sender.transport
        self._left = left
        sender.setTransport(self)  # type: ignore[arg-type] # it is one for all that a sender asks of it

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    async def _send_rtp(self, data: bytes) -> None:
        if not is_rtcp(data):
            self._left(data)
        await self._transport._send_rtp(data)


class PacedTransport(WatchedTransport):
    """Paces and copies the packets of pictures: the feed says after each of them how long the next one waits, and
    whether it is sent twice. Repeats and RTCP are never held up: they are sent by the task that also receives."""

    def __init__(self, sender: RTCRtpSender, feed: PictureFeed, left: Callable[[bytes], None]) -> None:
        super().__init__(sender, left)
        self._sender = sender
        self._feed = feed
        self._send_again = sender._retransmit
        self._to_copy: list[int] = []
        self._copying = BackgroundTasks()

    async def _send_rtp(self, data: bytes) -> None:
        await super()._send_rtp(data)
        if asyncio.current_task() is not self._sender._RTCRtpSender__rtp_task:  # type: ignore[attr-defined]
            return
        self._note_copy(data)
        # After sending, so that the next packet's send time is written when it really leaves.
        await self._feed.paced(len(data))

    def copy_later(self, sequence_numbers: list[int], after_s: float = COPY_AFTER_S) -> None:
        """Send these packets once more."""
        self._copying.start(self._copy(sequence_numbers, after_s))

    def _note_copy(self, data: bytes) -> None:
        sequence_number = int.from_bytes(data[2:4], "big")
        if self._feed.wants_copy(sequence_number, len(data)):
            self._to_copy.append(sequence_number)
        if data[1] & _MARKER and self._to_copy:
            self.copy_later(self._to_copy)
            self._to_copy = []

    async def _copy(self, sequence_numbers: list[int], after_s: float) -> None:
        await asyncio.sleep(after_s)
        with suppress(ConnectionError):
            for position, sequence_number in enumerate(sequence_numbers, 1):
                await self._send_again(sequence_number)
                if position % _COPIES_AT_ONCE == 0:
                    await asyncio.sleep(_COPY_PAUSE_S)
