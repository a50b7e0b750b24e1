"""A process of operators that receive and count pictures without decoding them, so that two cores suffice for ten."""

from __future__ import annotations

import asyncio
from multiprocessing.connection import Connection
from typing import Any

import aiortc.rtcrtpreceiver
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription


class CountingDecoder:
    """In the place of aiortc's decoders: everything before it (SRTP, jitter buffer, reports) is real."""

    pictures = 0

    def decode(self, encoded_frame: Any) -> list[Any]:
        CountingDecoder.pictures += 1
        return []


def view(robot: Connection, orders: Connection, viewers: int) -> None:
    """Connect ``viewers`` operators; then answer each ``count`` with the pictures so far, until ``end``."""
    module: Any = aiortc.rtcrtpreceiver
    module.get_decoder = lambda codec: CountingDecoder()
    asyncio.run(_view(robot, orders, viewers))


async def _view(robot: Connection, orders: Connection, viewers: int) -> None:
    peers, tasks = [], []
    for _ in range(viewers):
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        peers.append(peer)
        peer.addTransceiver("video", direction="recvonly")
        peer.on("track", lambda track: tasks.append(asyncio.ensure_future(track.recv())))
        await peer.setLocalDescription(await peer.createOffer())
        robot.send(peer.localDescription.sdp)
        answer = await asyncio.to_thread(robot.recv)
        await peer.setRemoteDescription(RTCSessionDescription(answer, "answer"))
    while await asyncio.to_thread(orders.recv) == "count":
        orders.send(CountingDecoder.pictures)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    await asyncio.gather(*(peer.close() for peer in peers))
