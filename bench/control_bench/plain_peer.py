"""The peer of the comparison: plain aiortc. One ordered channel for commands, one for bulk, nothing else."""

from __future__ import annotations

import asyncio
import multiprocessing
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

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
        await peer.setRemoteDescription(RTCSessionDescription(await self._call(), "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        self._pipe.send(peer.localDescription.sdp)
        while (call := await self._call()) is not None:
            if call == "arrivals":
                self._pipe.send(self._arrived)
            elif call == "quiet" and self._bulk is not None:
                self._bulk.cancel()
            elif isinstance(call, float):
                self._bulk = asyncio.create_task(self._send(channels["bulk"], call))
        await peer.close()

    async def _call(self) -> Any:
        try:
            return await asyncio.to_thread(self._pipe.recv)
        except (EOFError, ConnectionResetError):
            return None

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


def _serve(pipe: Connection) -> None:
    with suppress(KeyboardInterrupt):
        asyncio.run(PlainRobot(pipe).serve())


@contextmanager
def plain_robot() -> Iterator[Connection]:
    """The process of a :class:`PlainRobot` and the pipe to it."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=_serve, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    try:
        yield ours
    finally:
        ours.close()
        process.join(timeout=5)
        if process.is_alive():
            process.kill()
            process.join()


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
