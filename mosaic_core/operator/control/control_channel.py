"""The operator's ends of ``_mosaic`` and ``_stop``: hello first, pings both ways, and the rest handed over."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Protocol
from uuid import uuid4

from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.machines.timing.clock_offset import ClockOffset
from mosaic_core.operator.delivery.data_port import DataPort, now_us
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import CONTROL_EXTENSIONS, ControlMessage, Hello, Ping, Pong, parse_control
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import WireError

_log = logging.getLogger(__name__)

SOFTWARE = "mosaic-core operator"
BOOT_ID = uuid4().hex
"""Names this program's monotonic clock."""


class ControlListener(Protocol):
    """Hears what the robot says on its control channels."""

    def control_opened(self) -> None: ...
    def resume_word(self) -> ControlMessage:
        """What to say right after hello: how far the reliable channels are."""

    def control_heard(self, message: ControlMessage) -> None:
        """Every message; pings, which are answered already, and pongs too: they are a sign of life."""


class ControlChannel:
    """Greets the robot, answers its pings, and measures its clock by ours. Event loop only.

    ``clock_us`` is this operator's monotonic clock; ``is_person``: a person decides here, not a program.
    """

    def __init__(
        self,
        channel: Channel,
        stop_channel: Channel,
        listener: ControlListener,
        *,
        clock_us: Callable[[], int] = now_us,
        is_person: bool = False,
    ) -> None:
        self._listener = listener
        self._clock_us = clock_us
        self._is_person = is_person
        self.clock = ClockOffset()
        """The robot's clock by ours."""
        self._robot_boot_id = ""
        self._port = _words_port(channel, partial(self._received, self.send), self._changed, clock_us)
        received = partial(self._received, self.send_on_stop_channel)
        self._stop_port = _words_port(stop_channel, received, lambda is_open: None, clock_us)

    def robot_now_us(self) -> int | None:
        """What the robot's clock shows now."""
        return self.clock.to_theirs_us(self._clock_us())

    def send(self, message: ControlMessage) -> bool:
        return self._port.send(PayloadKind.JSON, message.to_text().encode())

    def send_on_stop_channel(self, message: ControlMessage) -> bool:
        """The stop channel; ``False`` while it is not open."""
        return self._stop_port.send(PayloadKind.JSON, message.to_text().encode())

    def ping(self) -> None:
        self.send(Ping(t0=self._clock_us()))

    def _changed(self, is_open: bool) -> None:
        if is_open:
            self._listener.control_opened()
            self.send(
                Hello(extensions=CONTROL_EXTENSIONS, software=SOFTWARE, boot_id=BOOT_ID, is_person=self._is_person)
            )
            self.send(self._listener.resume_word())

    def _received(self, answer: Callable[[ControlMessage], bool], frame: Frame) -> None:
        arrived_us = self._clock_us()
        try:
            message = parse_control(frame.payload.decode())
        except (WireError, UnicodeDecodeError) as error:
            _log.warning("the robot's control channel: %s", error)
            return
        match message:
            case Ping(t0=t0):
                answer(Pong(t0=t0, t1=arrived_us, t2=self._clock_us()))
            case Pong():
                self.clock.add(message.t0, message.t1, message.t2, arrived_us)
            case Hello(boot_id=boot_id) if boot_id != self._robot_boot_id:
                self._robot_boot_id = boot_id
                self.clock.reset()
            case _:
                pass
        if message is not None:
            self._listener.control_heard(message)


def _words_port(
    channel: Channel, received: Callable[[Frame], None], changed: Callable[[bool], None], clock_us: Callable[[], int]
) -> DataPort:
    return DataPort(channel, Delivery.RELIABLE, received, changed, clock_us=clock_us, max_queued_bytes=None)
