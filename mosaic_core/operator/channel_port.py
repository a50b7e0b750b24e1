"""One data channel as the operator uses it: framed toward a robot of ours, bare toward an original one."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mosaic_core.machines.framing import SEQ_MODULUS, Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.runtime.transport import Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConnectionFailed, WireError

_log = logging.getLogger(__name__)

MAX_QUEUED_BYTES = 64 * 1024
"""More than this in SCTP's queue makes commands late; what else is there to send must wait or be told no."""


@dataclass(frozen=True, slots=True)
class MessageInfo:
    """What came with a message. ``seq`` and ``stamp_us`` (the robot's clock) are 0 from original robots, and
    ``is_latched`` marks the last value, repeated for those who came later. ``age_s`` needs a known clock offset."""

    received_at_s: float
    seq: int = 0
    stamp_us: int = 0
    is_latched: bool = False
    age_s: float | None = None


@dataclass(frozen=True, slots=True)
class Received:
    """One message from the robot."""

    data: bytes
    info: MessageInfo

    def text(self) -> str:
        return self.data.decode()

    def json(self) -> Any:
        return json.loads(self.data)


class ChannelPort:
    """Event loop only. ``received`` gets whole messages; ``changed`` is called when the channel opens or closes."""

    def __init__(
        self,
        channel: Channel,
        delivery: Delivery,
        received: Callable[[Frame], None],
        changed: Callable[[bool], None],
    ) -> None:
        self._channel = channel
        self._delivery = delivery
        self._received = received
        self._changed = changed
        self._is_framed = channel.protocol == CHANNEL_PROTOCOL
        self._reader = FrameReader()
        self._seq = 0
        self._pending: tuple[PayloadKind, bytes] | None = None
        channel.on_message = self._arrived
        channel.on_open = lambda: changed(True)
        channel.on_close = lambda: changed(False)
        channel.on_drained = self._drained

    @property
    def is_open(self) -> bool:
        return self._channel.is_open

    def send(self, kind: PayloadKind, payload: bytes) -> bool:
        """Whether it was accepted. Under ``latest`` a message that can't leave yet waits, until a newer one comes."""
        if not self._channel.is_open:
            return False
        if self._channel.buffered_bytes >= MAX_QUEUED_BYTES:
            if self._delivery is not Delivery.LATEST:
                return False
            self._pending = (kind, payload)
            return True
        self._pending = None
        return self._send_now(kind, payload)

    def close(self) -> None:
        self._pending = None
        self._channel.on_close = None
        self._channel.close()

    def _send_now(self, kind: PayloadKind, payload: bytes) -> bool:
        try:
            if not self._is_framed:
                self._channel.send(payload if kind is PayloadKind.BYTES else payload.decode())
                return True
            self._seq = (self._seq + 1) % SEQ_MODULUS
            frame = Frame(kind, payload, seq=self._seq, stamp_us=now_us())
            for part in encode_frame(frame):
                self._channel.send(part)
        except ConnectionFailed as error:
            _log.info("%s", error.message)
            return False
        return True

    def _drained(self) -> None:
        if self._pending is not None:
            kind, payload = self._pending
            self.send(kind, payload)

    def _arrived(self, data: bytes | str) -> None:
        raw = data.encode() if isinstance(data, str) else data
        if not self._is_framed:
            kind = PayloadKind.STRING if isinstance(data, str) else PayloadKind.BYTES
            self._received(Frame(kind, raw))
            return
        try:
            frame = self._reader.read(raw, time.monotonic())
        except WireError as error:
            _log.warning("%s: %s", self._channel.label, error.message)
            return
        if frame is not None:
            self._received(frame)


def now_us() -> int:
    """This program's monotonic clock."""
    return time.monotonic_ns() // 1000


def info_of(frame: Frame, to_ours_us: Callable[[int], int | None]) -> MessageInfo:
    """What to tell a subscriber; the age only where the clocks are known."""
    sent_us = to_ours_us(frame.stamp_us) if frame.stamp_us else None
    at_us = now_us()
    age_s = None if sent_us is None else max(0.0, (at_us - sent_us) / 1e6)
    return MessageInfo(at_us / 1e6, frame.seq, frame.stamp_us, bool(frame.flags & FrameFlag.LATCHED), age_s)
