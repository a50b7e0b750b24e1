"""The peer of the comparison: plain aiortc. One ordered channel for commands, one for bulk, nothing else."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from processes.other_end import next_call

if TYPE_CHECKING:
    from aiortc import RTCDataChannel, RTCPeerConnection

BLOCK = bytes(16 * 1024)
TICK_S = 0.005
MOST_BUFFERED_BYTES = 1024 * 1024
"""What tutorials tell to wait for; without any bound the first seconds would already be spent on buffering."""


class PlainRobot:
    """In a process of its own: notes when a command arrives; sends bulk while told to."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._arrived: dict[int, float] = {}
        self._bulk: asyncio.Task[None] | None = None

    async def serve(self) -> None:
        from aiortc import RTCPeerConnection, RTCSessionDescription

        peer = RTCPeerConnection()
        channels: dict[str, RTCDataChannel] = {}

        def opened(channel: RTCDataChannel) -> None:
            channels[channel.label] = channel
            if channel.label == "command":
                channel.on("message", lambda number: self._arrived.setdefault(int(number), time.monotonic()))

        peer.on("datachannel", opened)
        await peer.setRemoteDescription(RTCSessionDescription(await next_call(self._pipe), "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        self._pipe.send(peer.localDescription.sdp)
        while (call := await next_call(self._pipe)) is not None:
            if call == "arrivals":
                self._pipe.send(self._arrived)
            elif call == "quiet" and self._bulk is not None:
                self._bulk.cancel()
            elif isinstance(call, float):
                self._bulk = asyncio.create_task(self._send(channels["bulk"], call))
        await peer.close()

    @staticmethod
    async def _send(channel: RTCDataChannel, rate_mbyteps: float) -> None:
        start_s, sent_bytes = time.monotonic(), 0
        while True:
            due_bytes = (time.monotonic() - start_s) * rate_mbyteps * 1e6
            while sent_bytes < due_bytes:
                if channel.bufferedAmount < MOST_BUFFERED_BYTES:
                    channel.send(BLOCK)
                sent_bytes += len(BLOCK)
            await asyncio.sleep(TICK_S)


def plain_robot(pipe: Connection) -> None:
    """A process that answers, until the pipe closes."""
    with suppress(KeyboardInterrupt):
        asyncio.run(PlainRobot(pipe).serve())


class PlainOperator:
    """Connected to a :class:`PlainRobot`."""

    def __init__(self, pipe: Connection, peer: RTCPeerConnection, command: RTCDataChannel) -> None:
        self._pipe, self._peer, self._command = pipe, peer, command
        self._number = 0
        self.bulk_bytes = 0

    @classmethod
    async def connected(cls, pipe: Connection) -> PlainOperator:
        from aiortc import RTCPeerConnection, RTCSessionDescription

        peer = RTCPeerConnection()
        command, bulk = peer.createDataChannel("command"), peer.createDataChannel("bulk")
        opened = asyncio.Event()
        command.on("open", lambda: opened.set())
        operator = cls(pipe, peer, command)
        bulk.on("message", operator._took)
        await peer.setLocalDescription(await peer.createOffer())
        pipe.send(peer.localDescription.sdp)
        await peer.setRemoteDescription(RTCSessionDescription(await asyncio.to_thread(pipe.recv), "answer"))
        await opened.wait()
        return operator

    def _took(self, data: bytes) -> None:
        self.bulk_bytes += len(data)

    def bulk(self, rate_mbyteps: float | None) -> None:
        """Let the robot send this much beside; ``None``: no more."""
        self._pipe.send("quiet" if rate_mbyteps is None else rate_mbyteps)

    async def latencies_ms(self, count: int, period_s: float) -> tuple[float, ...]:
        """Send commands; what each took until the robot's handler had it."""
        sent: dict[int, float] = {}
        for _ in range(count):
            self._number += 1
            sent[self._number] = time.monotonic()
            self._command.send(str(self._number))
            await asyncio.sleep(period_s)
        arrived: dict[int, float] = {}
        ends_at_s = time.monotonic() + 20
        while not sent.keys() <= arrived.keys():
            if time.monotonic() > ends_at_s:
                raise SystemExit("plain aiortc lost commands on an ordered channel")
            await asyncio.sleep(0.05)
            self._pipe.send("arrivals")
            arrived = await asyncio.to_thread(self._pipe.recv)
        return tuple(1000 * (arrived[number] - at_s) for number, at_s in sent.items())

    async def close(self) -> None:
        await self._peer.close()
