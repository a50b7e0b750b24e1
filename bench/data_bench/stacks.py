"""The Python stacks behind one face: one connection with one ordered, reliable data channel."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
    from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer

LABEL = "data"
MOST_BUFFERED_BYTES = 1024 * 1024
LEAST_BUFFERED_BYTES = 256 * 1024
"""Between these a sender on a bare stack keeps its buffer, as tutorials do."""


class Stack(Protocol):
    """One end. ``received`` gets every message."""

    received: Callable[[bytes], None]

    async def offer(self) -> str: ...
    async def answer(self, sdp: str) -> str: ...
    async def accept(self, sdp: str) -> None: ...
    async def opened(self) -> None: ...
    def send(self, data: bytes) -> bool:
        """``False``: not taken; try again when :meth:`has_room` returns."""
        ...

    async def has_room(self) -> None: ...
    async def close(self) -> None: ...


class PlainAiortc:
    """aiortc as its documentation shows it."""

    def __init__(self) -> None:
        from aiortc import RTCConfiguration, RTCPeerConnection

        self.received: Callable[[bytes], None] = lambda data: None
        self._pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._channel: Any = None
        self._is_open, self._room = asyncio.Event(), asyncio.Event()
        self._pc.on("datachannel", self._take)

    def _take(self, channel: Any) -> None:
        self._channel = channel
        channel.bufferedAmountLowThreshold = LEAST_BUFFERED_BYTES
        channel.on("bufferedamountlow", self._room.set)
        channel.on("message", lambda data: self.received(data))
        channel.on("open", self._is_open.set)
        if channel.readyState == "open":
            self._is_open.set()

    async def offer(self) -> str:
        self._take(self._pc.createDataChannel(LABEL))
        await self._pc.setLocalDescription()
        return str(self._pc.localDescription.sdp)

    async def answer(self, sdp: str) -> str:
        await self._hear(sdp, "offer")
        await self._pc.setLocalDescription()
        return str(self._pc.localDescription.sdp)

    async def accept(self, sdp: str) -> None:
        await self._hear(sdp, "answer")

    async def _hear(self, sdp: str, kind: str) -> None:
        from aiortc import RTCSessionDescription

        await self._pc.setRemoteDescription(RTCSessionDescription(sdp, kind))

    async def opened(self) -> None:
        await self._is_open.wait()

    def send(self, data: bytes) -> bool:
        if self._channel.bufferedAmount >= MOST_BUFFERED_BYTES:
            self._room.clear()
            return False
        self._channel.send(data)
        return True

    async def has_room(self) -> None:
        await self._room.wait()

    async def close(self) -> None:
        await self._pc.close()


class Ours:
    """Our adapters, and the send queue that every peer of a robot has."""

    is_local = True

    def __init__(self) -> None:
        from mosaic_core.runtime.delivery.send_queue import SendQueue
        from mosaic_core.runtime.transport.peer_congestion import PeerCongestion

        self.congestion = PeerCongestion()
        self.received: Callable[[bytes], None] = lambda data: None
        self._is_open, self._room = asyncio.Event(), asyncio.Event()
        self._queue = SendQueue(lambda _: self._room.set())
        self._peer: AiortcOfferer | AiortcAnswerer | None = None

    async def offer(self) -> str:
        from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer

        self._peer = peer = AiortcOfferer(self, ())
        self.channel_opened(peer.create_channel(LABEL))
        return (await peer.offer())[0]

    async def answer(self, sdp: str) -> str:
        from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer

        self._peer = peer = AiortcAnswerer(self, ())  # type: ignore[arg-type] # nobody speaks of media here
        return await peer.answer(sdp, (), None)

    async def accept(self, sdp: str) -> None:
        await self._peer.accept_answer(sdp)  # type: ignore[union-attr] # who accepts has offered

    async def opened(self) -> None:
        await self._is_open.wait()

    def send(self, data: bytes) -> bool:
        from mosaic_core.machines.delivery.send_scheduler import Offered, QueuedMessage

        if self._queue.offer(QueuedMessage(LABEL, iter((data,)), len(data))) is Offered.REFUSED:
            self._room.clear()
            return False
        return True

    async def has_room(self) -> None:
        await self._room.wait()

    async def close(self) -> None:
        self._queue.close_all()
        if self._peer is not None:
            await self._peer.close()

    # -- told by the peer connection; both descriptions carry all candidates ---------------------------------------

    def candidate_found(self, candidate: Any) -> None: ...
    def state_changed(self, state: str) -> None: ...
    def bound_exceeded(self, why: str) -> None: ...
    def track_arrived(self, label: str, video: Any) -> None: ...

    def channel_opened(self, channel: Any) -> None:
        from mosaic_core.machines.delivery.send_scheduler import Priority

        def opened() -> None:
            self._queue.open(channel, Priority.RELIABLE)
            self._is_open.set()

        channel.on_message = lambda data: self.received(data)
        channel.on_open = opened
        if channel.is_open:
            opened()


class NativeWrtc:
    """libwebrtc itself, as `wrtc` wraps it for Python."""

    def __init__(self) -> None:
        import webrtc  # type: ignore[import-not-found,unused-ignore]

        self.received: Callable[[bytes], None] = lambda data: None
        self._webrtc = webrtc
        self._pc: Any = webrtc.RTCPeerConnection()
        self._channel: Any = None
        self._is_open, self._room, self._is_gathered = asyncio.Event(), asyncio.Event(), asyncio.Event()
        self._pc.on("datachannel", lambda event: self._take(event.channel))
        self._pc.on("icegatheringstatechange", self._look)

    def _look(self, _: object) -> None:
        if self._pc.ice_gathering_state == "complete":
            self._is_gathered.set()

    def _take(self, channel: Any) -> None:
        self._channel = channel
        channel.buffered_amount_low_threshold = LEAST_BUFFERED_BYTES
        channel.on("bufferedamountlow", lambda _: self._room.set())
        channel.on("message", lambda event: self.received(event.data))
        channel.on("open", lambda _: self._is_open.set())
        if channel.ready_state == "open":
            self._is_open.set()

    async def offer(self) -> str:
        self._take(self._pc.create_data_channel(LABEL))
        return await self._describe()

    async def answer(self, sdp: str) -> str:
        await self._hear(sdp, "offer")
        return await self._describe()

    async def accept(self, sdp: str) -> None:
        await self._hear(sdp, "answer")

    async def _describe(self) -> str:
        await self._pc.set_local_description()
        await asyncio.wait_for(self._is_gathered.wait(), 5)
        return str(self._pc.local_description.sdp)

    async def _hear(self, sdp: str, kind: Literal["offer", "answer"]) -> None:
        await self._pc.set_remote_description(self._webrtc.RTCSessionDescriptionInit(type=kind, sdp=sdp))

    async def opened(self) -> None:
        await self._is_open.wait()

    def send(self, data: bytes) -> bool:
        if self._channel.buffered_amount >= MOST_BUFFERED_BYTES:
            self._room.clear()
            return False
        self._channel.send(data)
        return True

    async def has_room(self) -> None:
        await self._room.wait()

    async def close(self) -> None:
        self._pc.close()


STACKS: dict[str, Callable[[], Stack]] = {"ours": Ours, "aiortc": PlainAiortc, "wrtc": NativeWrtc}
