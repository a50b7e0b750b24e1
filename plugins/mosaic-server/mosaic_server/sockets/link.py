"""The one place that reaches below ASGI, into uvicorn's sans-IO WebSocket protocol.

ASGI knows neither pongs nor aborting nor a frame limit that changes; a server that must notice a dead socket within
seconds and survive a client that stops reading needs all three. What is sent goes straight to the transport, whose
buffer is the bounded queue: order is kept and no task waits for a slow client.
The application finds the :class:`Link` of its socket in ``scope["extensions"][LINK]``.
"""

from __future__ import annotations

import secrets
import time
from typing import Any

from starlette.types import Scope
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode as StandardCloseCode
from websockets.frames import Frame
from websockets.protocol import State
from websockets.server import ServerProtocol

from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.codes import CLOSE_REASONS, CloseCode
from mosaic_core.words.signaling import SIZE_BEFORE_AUTHORIZATION
from mosaic_server.entrance.entrance import Entrance
from mosaic_server.entrance.places import EntrancePlace

LINK = "mosaic.link"
CLOSE_GRACE_S = 1.0
"""A client that doesn't take the close frame within this is cut off."""


_GOODBYES = (StandardCloseCode.NORMAL_CLOSURE, StandardCloseCode.GOING_AWAY, StandardCloseCode.NO_STATUS_RCVD)

MAX_UNSENT_BYTES = 2 * 1024 * 1024
"""What may wait for a slow client, beyond the kernel's own buffer; eight of the largest frames."""


FRAMES_PER_S = 50.0
FRAME_BURST = 500.0
"""A page that opens several robots at once sends some hundred candidates within a second."""
STRANGERS_SHARE = 0.1
"""Of both, for a socket that has not logged in yet: it needs one message for that."""
_BYTES_PER_TOKEN = 16 * 1024
"""A frame costs one token, and one more for so many bytes."""
_SLICE_BYTES = 2048
"""So much is read at a time before the frames are counted: some hundred pings, a few milliseconds."""


class _LimitedProtocol(ServerProtocol):
    """Says that a message was too large with our close code, before any of it is kept, and counts all frames: pings,
    pongs and parts of messages cost as much as messages do."""

    frames_seen = 0
    bytes_seen = 0

    def recv_frame(self, frame: Frame) -> None:
        self.frames_seen += 1
        self.bytes_seen += len(frame.data)
        super().recv_frame(frame)

    def fail(self, code: StandardCloseCode | int, reason: str = "") -> None:
        if code == StandardCloseCode.MESSAGE_TOO_BIG:
            code, reason = CloseCode.TOO_LARGE, CLOSE_REASONS[CloseCode.TOO_LARGE]
        super().fail(code, reason)


class Link:
    """Sends on and closes a socket below ASGI. Event-loop thread only."""

    def __init__(self, protocol: LinkedProtocol) -> None:
        self._protocol = protocol

    @property
    def heard_at_s(self) -> float:
        """When anything arrived last (message, pong, a part of a frame), on the monotonic clock."""
        return self._protocol.heard_at_s

    @property
    def said_goodbye(self) -> bool:
        """The client closed it by itself and properly: a page that was closed or left, a program that ended."""
        received = self._protocol.conn.close_rcvd
        return received is not None and received.code in _GOODBYES and bool(self._protocol.conn.close_rcvd_then_sent)

    def send(self, text: str) -> bool:
        """Send at once, never waiting. False: the client does not keep up, and nothing more should be sent to it."""
        return self._protocol.send_now(text)

    def limit_frames(self, size_bytes: int) -> None:
        """It has logged in: take frames of this size, and as many as a page or a robot sends."""
        self._protocol.conn.max_message_size = size_bytes
        self._protocol.rate = TokenBucket(FRAMES_PER_S, FRAME_BURST)

    def ping(self) -> None:
        """A ping frame; every WebSocket implementation answers it (RFC 6455 §5.5.2), C1 robots included."""
        self._protocol.ping()

    def close(self, code: int, reason: str) -> None:
        """Send the close frame even if the client reads nothing, and cut it off when it doesn't answer."""
        self._protocol.close_with(code, reason)


class LinkedProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol, with a :class:`Link` for the application. Pass it as ``ws=`` to uvicorn."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.conn: _LimitedProtocol = _LimitedProtocol(max_size=SIZE_BEFORE_AUTHORIZATION, logger=self.logger)
        self.heard_at_s = time.monotonic()
        self.rate = TokenBucket(FRAMES_PER_S * STRANGERS_SHARE, FRAME_BURST * STRANGERS_SHARE)
        self._entrance: Entrance | None = None
        self._place: EntrancePlace | None = None
        self._talks_too_much = False

    def entered(self, entrance: Entrance, place: EntrancePlace) -> None:
        """The connection was an HTTP request until now; it gives its place back when it ends."""
        self._entrance, self._place = entrance, place

    def connection_lost(self, exc: Exception | None) -> None:
        if self._entrance is not None and self._place is not None:
            self._entrance.leave(self._place)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        self.heard_at_s = time.monotonic()
        for start in range(0, len(data), _SLICE_BYTES):
            if self._talks_too_much or self.transport.is_closing():
                return
            super().data_received(data[start : start + _SLICE_BYTES])
            self._count()
        if self.transport.get_write_buffer_size() > 2 * MAX_UNSENT_BYTES:
            self.transport.abort()  # it pings and never reads the pongs, which no send_now counts

    def _count(self) -> None:
        tokens = self.conn.frames_seen + self.conn.bytes_seen / _BYTES_PER_TOKEN
        self.conn.frames_seen = self.conn.bytes_seen = 0
        if not tokens or self.rate.admits(self.heard_at_s, tokens):
            return
        self._talks_too_much = True
        if self._entrance is not None:
            client = self.scope["client"]
            address = client[0] if client else ""
            self._entrance.refusals.note("a WebSocket (it sends more than it may)", address, self.heard_at_s)
        self.close_with(CloseCode.TOO_SLOW, CLOSE_REASONS[CloseCode.TOO_SLOW])

    async def run_asgi(self) -> None:
        scope: Scope = self.scope  # type: ignore[assignment]
        scope["extensions"][LINK] = Link(self)
        await super().run_asgi()

    def send_now(self, text: str) -> bool:
        if self.conn.state is not State.OPEN or self.transport.is_closing():
            return True  # its end is on the way to the application already
        if self.transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            return False
        self.conn.send_text(text.encode())
        self._flush()
        return True

    def ping(self) -> None:
        if self.conn.state is State.OPEN and not self.transport.is_closing():
            self.conn.send_ping(secrets.token_bytes(4))
            self._flush()

    def close_with(self, code: int, reason: str) -> None:
        if self.disconnected:
            return
        if self.conn.state is State.OPEN and not self.transport.is_closing():
            self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
            self.conn.send_close(code, reason)
            self._flush()
            self.close_sent = True
            self.transport.resume_reading()
        if self.close_timer is None:
            self.close_timer = self.loop.call_later(CLOSE_GRACE_S, self.transport.abort)

    def shutdown(self) -> None:
        """The server stops: 1001 tells browsers and robots to come back, 1012 is unknown to older ones."""
        if self.handshake_complete:
            self.close_with(StandardCloseCode.GOING_AWAY, "signal.server_restart")
        else:
            super().shutdown()

    def _flush(self) -> None:
        self.transport.write(b"".join(self.conn.data_to_send()))
