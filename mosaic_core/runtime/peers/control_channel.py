"""The channel ``_mosaic`` of one peer: hello, catalogue, ping, watching, refusals, bye."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.commands.refusal_news import RefusalNews
from mosaic_core.machines.delivery.framing import PayloadKind
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
    parse_control,
)
from mosaic_core.words.errors import WireError

logger = logging.getLogger(__name__)

MAX_CONTROL_BYTES = 256 * 1024
"""As on the server's socket: an offer with many media lines is this large."""
MAX_PINGS_HZ = 20.0
"""Ours come every half a second; whoever sends more than this gets no answer to them."""


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
        priority: Priority = Priority.CONTROL,
    ) -> None:
        self._port = DataPort(channel, baseline, MAX_CONTROL_BYTES)
        self._queue = queue
        self._heard = heard
        self._pings = TokenBucket.of_rate(MAX_PINGS_HZ)
        self._refusals: MachineDriver[Refusal, Refusal] = MachineDriver(RefusalNews(), self.send)
        queue.open(channel, priority)
        channel.on_message = self._received

    def greet(self, software: str, boot_id: str) -> None:
        """Say hello as soon as the channel is open."""
        hello = Hello(extensions=CONTROL_EXTENSIONS, software=software, boot_id=boot_id)
        if self._port.channel.is_open:
            self.send(hello)
        else:
            self._port.channel.on_open = lambda: self.send(hello)

    def send(self, message: ControlMessage) -> None:
        text = message.to_text().encode()
        outgoing = Outgoing(CONTROL_LABEL, PayloadKind.JSON, text, _now_us())
        self._queue.offer(self._port.outgoing(outgoing))

    def refuse(self, label: str, seq: int | None, code: str, message: str = "", gate: str = "") -> None:
        """Tell the operator; of a flood alike, the next one that is told says how many there were."""
        self._refusals.tell(Refusal(label=label, seq=seq, code=code, gate=gate or None, message=message or None))

    def _received(self, data: bytes | str) -> None:
        arrived_us = _now_us()
        try:
            if len(data) > MAX_CONTROL_BYTES:
                raise WireError("control channel: message too large", code="channel.too_large")
            frame = self._port.incoming(data)
            if frame is None:
                return
            self._port.observe(frame)
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
