"""Wraps a data channel of aiortc behind the runtime's :class:`Channel`, with backpressure for the whole peer."""

from __future__ import annotations

from collections.abc import Callable

from aiortc import InvalidStateError, RTCDataChannel, RTCPeerConnection

from mosaic_core.adapters.aiortc_private.sctp.sctp import SctpQueue
from mosaic_core.machines.congestion.background_rate import BackgroundRate
from mosaic_core.words.errors import ConnectionFailed

LOW_WATER_BYTES = 16 * 1024
"""``on_drained`` fires whenever the queue got shorter and is this short: a quarter of what may wait (64 KiB)."""


class PeerBuffer:
    """Tells all channels of one peer connection when SCTP's queue, which they share, has become short."""

    def __init__(self, pc: RTCPeerConnection) -> None:
        self._pc = pc
        self._queue: SctpQueue | None = None
        self._last_bytes = 0
        self.listeners: set[AiortcChannel] = set()
        self.background: BackgroundRate | None = None
        """How fast what gives way is sent."""
        self.on_left: Callable[[int], None] | None = None
        """Is told the size of every packet of what does not."""

    @property
    def queue(self) -> SctpQueue:
        """The association's; it exists from the first data channel on."""
        if self._queue is None:
            assert self._pc.sctp is not None
            self._queue = SctpQueue(self._pc.sctp, self._progressed, self.on_left)
        return self._queue

    def added(self) -> None:
        self._last_bytes = self.queue.queued_bytes

    def _progressed(self) -> None:
        now_bytes, before_bytes = self.queue.queued_bytes, self._last_bytes
        self._last_bytes = now_bytes
        if now_bytes < before_bytes and now_bytes <= LOW_WATER_BYTES:
            for channel in list(self.listeners):
                if channel.on_drained is not None:
                    channel.on_drained()


class AiortcChannel:
    """Wraps a data channel of aiortc; a ``runtime.transport.Channel``. All calls and callbacks on the event loop."""

    def __init__(self, channel: RTCDataChannel, buffer: PeerBuffer) -> None:
        self.on_message: Callable[[bytes | str], None] | None = None
        self.on_open: Callable[[], None] | None = None
        self.on_close: Callable[[], None] | None = None
        self.on_drained: Callable[[], None] | None = None
        self.label, self.protocol = channel.label, channel.protocol
        self._channel = channel
        self._buffer = buffer
        self._queue = buffer.queue
        self._is_closed = False
        buffer.listeners.add(self)
        channel.on("message", self._received)
        channel.on("open", self._opened)
        channel.on("close", self._closed)

    @property
    def is_reliable(self) -> bool:
        channel = self._channel
        return channel.ordered and channel.maxRetransmits is None and channel.maxPacketLifeTime is None

    @property
    def is_first(self) -> bool:
        """Each side numbers its streams by twos in the order of its channels, from 0 or 1 on (RFC 8832 §6)."""
        return self._channel.id in (0, 1)

    @property
    def is_open(self) -> bool:
        return self._channel.readyState == "open"

    @property
    def buffered_bytes(self) -> int:
        return self._queue.queued_bytes

    @property
    def window_bytes(self) -> int:
        return self._queue.window_bytes

    @property
    def under_way_bytes(self) -> int:
        return self._queue.under_way_bytes

    def give_way(self, on: bool) -> None:
        self._queue.give_way(on, self._buffer.background)

    def send(self, data: bytes | str) -> None:
        try:
            self._channel.send(data)
        except InvalidStateError:
            raise ConnectionFailed(f"The data channel {self.label!r} is not open.", code="peer.closed") from None
        except ValueError as error:
            raise ConnectionFailed(f"{self.label!r}: {error}", code="channel.too_large") from None
        self._buffer.added()

    def close(self) -> None:
        """Close it; doing so twice does nothing."""
        if self._channel.readyState not in ("closing", "closed"):
            self._channel.close()

    def _received(self, data: bytes | str) -> None:
        if self.on_message is not None:
            self.on_message(data)

    def _opened(self) -> None:
        if self.on_open is not None:
            self.on_open()

    def _closed(self) -> None:
        self._buffer.listeners.discard(self)
        if not self._is_closed and self.on_close is not None:
            self._is_closed = True
            self.on_close()
