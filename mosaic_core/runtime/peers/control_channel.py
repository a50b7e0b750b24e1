"""The two channels of one peer that carry words: ``_mosaic`` (hello, catalogue, ping, watching, refusals, bye), and
``_stop``, a lane of its own, past every queue.

The robot's pings take the latter too: on an ordered channel one lost packet would look like a round trip of half a
second.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TypeAlias

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.commands.refusal_news import RefusalNews
from mosaic_core.machines.delivery.framing import SEQ_MODULUS, Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.machines.delivery.send_scheduler import Priority
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.delivery.data_port import DataPort
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.timing.machine_driver import MachineDriver
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import (
    CONTROL_EXTENSIONS,
    CONTROL_LABEL,
    ControlMessage,
    Hello,
    Ping,
    Pong,
    Refusal,
    Stop,
    parse_control,
)
from mosaic_core.words.errors import ConnectionFailed, WireError

logger = logging.getLogger(__name__)

MAX_CONTROL_BYTES = 256 * 1024
"""As on the server's socket: an offer with many media lines is this large."""
MAX_PINGS_HZ = 20.0
"""Ours come every half a second; whoever sends more than this gets no answer to them."""
MAX_UNSENT_BYTES = 1024 * 1024
"""What the robot says past every queue is left out while so much waits for a peer that takes nothing: it is said
again, when the question comes again."""


class ControlChannel:
    """The robot's end of the control channel of one peer. Event loop only. ``heard`` gets every message but pings,
    which are answered here, and ``None`` for those.
    """

    def __init__(
        self,
        channel: Channel,
        queue: SendQueue,
        baseline: ArrivalBaseline,
        heard: Callable[[ControlMessage | None], None],
        lane: Priority = Priority.CONTROL,
    ) -> None:
        self._link = DataPort(channel, baseline, MAX_CONTROL_BYTES)
        self._queue = queue
        self._heard = heard
        self._pings = TokenBucket.of_rate(MAX_PINGS_HZ)
        self._refusals: MachineDriver[Refusal, Refusal] = MachineDriver(RefusalNews(), self.send)
        queue.open(channel, lane)
        channel.on_message = self._received

    def greet(self, software: str, boot_id: str) -> None:
        """Say hello as soon as the channel is open."""
        hello = Hello(extensions=CONTROL_EXTENSIONS, software=software, boot_id=boot_id)
        if self._link.channel.is_open:
            self.send(hello)
        else:
            self._link.channel.on_open = lambda: self.send(hello)

    def send(self, message: ControlMessage) -> None:
        text = message.to_text().encode()
        outgoing = Outgoing(CONTROL_LABEL, PayloadKind.JSON, text, _now_us())
        self._queue.offer(self._link.outgoing(outgoing))

    def refuse(self, label: str, seq: int | None, code: str, message: str = "", gate: str = "") -> None:
        """Tell the operator; of a flood alike, the next one that is told says how many there were."""
        self._refusals.tell(Refusal(label=label, seq=seq, code=code, gate=gate or None, message=message or None))

    def _received(self, data: bytes | str) -> None:
        arrived_us = _now_us()
        try:
            if len(data) > MAX_CONTROL_BYTES:
                raise WireError("control channel: message too large", code="channel.too_large")
            frame = self._link.incoming(data)
            if frame is None:
                return
            self._link.observe(frame)
            message = parse_control(frame.payload.decode())
        except (WireError, UnicodeDecodeError) as error:
            code = error.code if isinstance(error, WireError) else "signal.bad_message"
            logger.debug("unreadable control message: %s", error)
            self.refuse(CONTROL_LABEL, None, code, str(error))
            return
        if isinstance(message, Ping):
            if self._pings.admits(time.monotonic()):
                self.send(Pong(t0=message.t0, t1=arrived_us, t2=_now_us()))
            message = None
        self._heard(message)


def _now_us() -> int:
    return int(time.monotonic() * 1e6)


MAX_STOP_BYTES = 2048


Heard: TypeAlias = Callable[[Stop | Pong, Callable[[ControlMessage], None]], None]


class StopChannel:
    """The robot's end of the stop channel of one peer. Event loop only. ``heard`` gets every stop and pong that
    arrives, and what answers it here.
    """

    def __init__(self, channel: Channel, heard: Heard) -> None:
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
