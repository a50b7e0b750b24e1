"""Spreads the packets of large pictures: aiortc sends all packets of a picture in one go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from aiortc import RTCRtpSender


class PacedTransport:
    """Stands between a sender and its DTLS transport. ``wait_s(size_bytes)`` is asked after each media packet;
    repeats and RTCP are never held up: they are sent by the task that also receives."""

    def __init__(self, sender: RTCRtpSender, wait_s: Callable[[int], float]) -> None:
        self._sender = sender
        self._transport = sender.transport
        self._wait_s = wait_s
        sender.setTransport(self)  # type: ignore[arg-type] # it is one for all that a sender asks of it

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    async def _send_rtp(self, data: bytes) -> None:
        await self._transport._send_rtp(data)
        if asyncio.current_task() is not self._sender._RTCRtpSender__rtp_task:  # type: ignore[attr-defined]
            return
        # After sending, so that the next packet's send time is written when it really leaves.
        pause_s = self._wait_s(len(data))
        if pause_s > 0.0:
            await asyncio.sleep(pause_s)
