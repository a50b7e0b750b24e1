"""The operator's end of ``_mosaic``: says hello first, times its pings, and hands the rest over."""

from __future__ import annotations

import logging
from collections.abc import Callable
from uuid import uuid4

from mosaic_core.machines.clock_offset import ClockOffset
from mosaic_core.machines.framing import Frame, PayloadKind
from mosaic_core.operator.channel_port import ChannelPort, now_us
from mosaic_core.runtime.transport import Channel
from mosaic_core.words.control import CONTROL_EXTENSIONS, ControlMessage, Hello, Ping, Pong, parse_control
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import WireError

_log = logging.getLogger(__name__)

SOFTWARE = "mosaic-core operator"
BOOT_ID = uuid4().hex
"""Names this program's monotonic clock."""


class ControlPort:
    """``heard`` gets every message, pongs too (they are a sign of life)."""

    def __init__(self, channel: Channel, heard: Callable[[ControlMessage], None]) -> None:
        self._heard = heard
        self._clock = ClockOffset()
        self._robot_boot_id = ""
        self._port = ChannelPort(channel, Delivery.RELIABLE, self._received, self._changed)

    @property
    def round_trip_ms(self) -> float | None:
        return None if self._clock.round_trip_us is None else self._clock.round_trip_us / 1e3

    @property
    def best_round_trip_us(self) -> int | None:
        return self._clock.best.round_trip_us if self._clock.best else None

    @property
    def clock_offset_us(self) -> int | None:
        return self._clock.best.offset_us if self._clock.best else None

    def to_ours_us(self, theirs_us: int) -> int | None:
        return self._clock.to_ours_us(theirs_us)

    def send(self, message: ControlMessage) -> bool:
        return self._port.send(PayloadKind.JSON, message.to_text().encode())

    def ping(self) -> None:
        self.send(Ping(t0=now_us()))

    def _changed(self, is_open: bool) -> None:
        if is_open:
            self.send(Hello(extensions=CONTROL_EXTENSIONS, software=SOFTWARE, boot_id=BOOT_ID))

    def _received(self, frame: Frame) -> None:
        arrived_us = now_us()
        try:
            message = parse_control(frame.payload.decode())
        except (WireError, UnicodeDecodeError) as error:
            _log.warning("the robot's control channel: %s", error)
            return
        if isinstance(message, Pong):
            self._clock.add(message.t0, message.t1, message.t2, arrived_us)
        if isinstance(message, Hello) and message.boot_id != self._robot_boot_id:
            self._robot_boot_id = message.boot_id
            self._clock.reset()
        if message is not None:
            self._heard(message)
