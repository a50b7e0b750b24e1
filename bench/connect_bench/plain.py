"""The peer of the comparison: plain aiortc at both ends; the SDPs go through a pipe."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from processes.other_end import next_call

from connect_bench.firsts import ATTEMPT_S, Firsts, taken

if TYPE_CHECKING:
    from aiortc import RTCPeerConnection


def new_peer(stun_urls: Sequence[str]) -> RTCPeerConnection:
    from aiortc import RTCConfiguration, RTCIceServer, RTCPeerConnection

    return RTCPeerConnection(RTCConfiguration(iceServers=[RTCIceServer(urls=url) for url in stun_urls]))


async def aiortc_attempt(pipe: Connection, stun_urls: Sequence[str]) -> Firsts:
    """Offer a channel and a video line to the other process; the SDPs go through the pipe."""
    from aiortc import MediaStreamTrack, RTCSessionDescription

    tracks: asyncio.Queue[MediaStreamTrack] = asyncio.Queue()
    messages: asyncio.Queue[str] = asyncio.Queue()
    clicked_at_s = time.perf_counter()
    peer = new_peer(stun_urls)
    peer.on("track", tracks.put_nowait)
    peer.createDataChannel("pose").on("message", messages.put_nowait)
    peer.addTransceiver("video", direction="recvonly")

    async def first_frame() -> None:
        await (await tracks.get()).recv()

    try:
        await peer.setLocalDescription(await peer.createOffer())
        pipe.send((peer.localDescription.sdp, list(stun_urls)))
        answer = await asyncio.to_thread(received, pipe)
        await peer.setRemoteDescription(RTCSessionDescription(answer, "answer"))
        firsts = Firsts(*await asyncio.gather(taken(messages.get(), clicked_at_s), taken(first_frame(), clicked_at_s)))
    finally:
        await peer.close()
    pipe.send(None)
    await asyncio.to_thread(received, pipe)
    return firsts


def received(pipe: Connection) -> Any:
    """The next word of the other process; never waits for ever, because nobody could end this thread."""
    if not pipe.poll(ATTEMPT_S):
        raise TimeoutError
    return pipe.recv()


def answer_calls(pipe: Connection) -> None:
    """The other process: one call after the other, until the pipe closes."""
    asyncio.run(answered(pipe))


async def answered(pipe: Connection) -> None:
    from aiortc import RTCDataChannel, RTCSessionDescription, VideoStreamTrack

    def greet(channel: RTCDataChannel) -> None:
        channel.send("first")

    while (call := await next_call(pipe)) is not None:
        offer, stun_urls = call
        peer = new_peer(stun_urls)
        peer.on("datachannel", greet)
        peer.addTrack(VideoStreamTrack())
        await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        pipe.send(peer.localDescription.sdp)
        await next_call(pipe)
        await peer.close()
        pipe.send(None)
