"""The channel ``_stop`` of one peer: past every queue, so that nothing else delays a stop.

The robot's pings take it too: on an ordered channel one lost packet would look like a round trip of half a second.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TypeAlias

from mosaic_core.machines.delivery.framing import SEQ_MODULUS, Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import ControlMessage, Pong, Stop, parse_control
from mosaic_core.words.errors import ConnectionFailed, WireError

logger = logging.getLogger(__name__)

MAX_STOP_BYTES = 2048
MAX_UNSENT_BYTES = 1024 * 1024
"""What the robot says past every queue is left out while so much waits for a peer that takes nothing: it is said
again, when the question comes again."""

StopHeard: TypeAlias = Callable[[Stop | Pong, Callable[[ControlMessage], None]], None]


class StopChannel:
    """The robot's end of the stop channel of one peer. Event loop only. ``heard`` gets every stop and pong that
    arrives, and what answers it here.
    """

    def __init__(self, channel: Channel, heard: StopHeard) -> None:
        self._channel = channel
        self._heard = heard
        self._reader = FrameReader(MAX_STOP_BYTES)
        self._seq = 0
        channel.on_message = self._received

    @property
    def is_open(self) -> bool:
        return self._channel.is_open

    def send(self, message: ControlMessage) -> None:
        """At once, past the send queue: an answer that waits behind bulk would be repeated for nothing."""
        if self._channel.buffered_bytes > MAX_UNSENT_BYTES:
            return
        self._seq = (self._seq + 1) % SEQ_MODULUS
        stamp_us = int(time.monotonic() * 1e6)
        frame = Frame(PayloadKind.JSON, message.to_text().encode(), seq=self._seq, stamp_us=stamp_us)
        try:
            for piece in encode_frame(frame):
                self._channel.send(piece)
        except ConnectionFailed:
            logger.debug("the stop channel is gone")

    def _received(self, data: bytes | str) -> None:
        try:
            if isinstance(data, str) or len(data) > MAX_STOP_BYTES:
                raise WireError("stop channel: not a small frame")
            frame = self._reader.read(data, time.monotonic())
            message = None if frame is None else parse_control(frame.payload.decode())
        except (WireError, UnicodeDecodeError) as error:
            logger.debug("unreadable message on the stop channel: %s", error)
            return
        if isinstance(message, Stop | Pong):
            self._heard(message, self.send)
