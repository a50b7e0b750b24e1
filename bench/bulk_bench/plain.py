"""The peer of the comparison: plain aiortc, everything on one association, in two processes joined by a pipe."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from processes.other_end import next_call

from bulk_bench.connectors import BULK_MESSAGE

if TYPE_CHECKING:
    from aiortc import RTCDataChannel, RTCPeerConnection

MOST_BUFFERED_BYTES = 1024 * 1024
"""What tutorials tell to wait for; aiortc itself has no bound."""
TICK_S = 0.002


async def _serve(pipe: Connection) -> None:
    from aiortc import RTCPeerConnection, RTCSessionDescription

    peer = RTCPeerConnection()
    channels: dict[str, RTCDataChannel] = {}
    flood: asyncio.Task[None] | None = None

    def opened(channel: RTCDataChannel) -> None:
        channels[channel.label] = channel
        if channel.label == "command":
            channel.on("message", lambda text: channel.send(_answer(text)))

    peer.on("datachannel", opened)
    while (call := await next_call(pipe)) is not None:
        if call == "flood":
            flood = asyncio.create_task(_flood(channels["bulk"]))
        elif call == "quiet" and flood is not None:
            flood.cancel()
        elif call not in ("flood", "quiet"):
            await peer.setRemoteDescription(RTCSessionDescription(call, "offer"))
            await peer.setLocalDescription(await peer.createAnswer())
            pipe.send(peer.localDescription.sdp)
    await peer.close()


def _answer(text: str) -> str:
    return json.dumps({"number": json.loads(text)["number"], "came_s": time.monotonic()})


async def _flood(channel: RTCDataChannel) -> None:
    while True:
        while channel.bufferedAmount < MOST_BUFFERED_BYTES:
            channel.send(BULK_MESSAGE)
        await asyncio.sleep(TICK_S)


def plain_robot(pipe: Connection) -> None:
    """A process that answers, until the pipe closes."""
    with suppress(KeyboardInterrupt):
        asyncio.run(_serve(pipe))


class PlainOperator:
    """Connected to a :func:`plain_robot`; commands and bulk as the bench wants them."""

    def __init__(self, pipe: Connection, peer: RTCPeerConnection, command: RTCDataChannel) -> None:
        self._pipe, self._peer, self._command = pipe, peer, command
        self.bulk_bytes = 0
        self.heard: Any = None

    @classmethod
    async def connected(cls, pipe: Connection) -> PlainOperator:
        from aiortc import RTCPeerConnection, RTCSessionDescription

        peer = RTCPeerConnection()
        command = peer.createDataChannel("command", ordered=False, maxRetransmits=0)
        bulk = peer.createDataChannel("bulk")
        opened = asyncio.Event()
        command.on("open", lambda: opened.set())
        operator = cls(pipe, peer, command)
        bulk.on("message", operator._took)
        command.on("message", lambda text: operator.heard(json.loads(text)))
        await peer.setLocalDescription(await peer.createOffer())
        pipe.send(peer.localDescription.sdp)
        await peer.setRemoteDescription(RTCSessionDescription(await asyncio.to_thread(pipe.recv), "answer"))
        await opened.wait()
        return operator

    def send(self, value: dict[str, Any]) -> None:
        self._command.send(json.dumps(value))

    async def flood(self, on: bool) -> None:
        self._pipe.send("flood" if on else "quiet")

    async def close(self) -> None:
        await self._peer.close()

    def _took(self, data: bytes) -> None:
        self.bulk_bytes += len(data)
