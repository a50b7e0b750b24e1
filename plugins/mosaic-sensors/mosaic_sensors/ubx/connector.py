"""The ``gps-ubx`` connector: positions of a u-blox receiver, and corrections for it."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field
from pyubx2 import SET, UBXMessage, UBXReader  # type: ignore[import-untyped]
from pyubx2.exceptions import UBXMessageError, UBXParseError, UBXTypeError  # type: ignore[import-untyped]

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable, Handler
from mosaic_core.contract.params import Params
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.messages import GpsFix, wall_time_us
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import DeviceGone, Refused
from mosaic_sensors.byte_source import ByteSource, FakeSource, LiveSource, baud_doubt, opened
from mosaic_sensors.serial_lines.link import LineLink
from mosaic_sensors.ubx.fake_receiver import FakeUbxReceiver
from mosaic_sensors.ubx.frames import UbxFrames
from mosaic_sensors.ubx.rtcm import checked_frames
from mosaic_sensors.ubx.solution import NAV_PVT, fix_of

_log = logging.getLogger(__name__)

_TELL = (
    UBXMessage("CFG", "CFG-MSG", SET, msgClass=0x01, msgID=0x07, rateDDC=1, rateUART1=1, rateUART2=1, rateUSB=1),
    UBXMessage.config_set(1, 0, [(f"CFG_MSGOUT_UBX_NAV_PVT_{port}", 1) for port in ("UART1", "UART2", "USB")]),
)
"""Asks for NAV-PVT in every epoch, until the receiver is without power: generations 6 to 8, and from 9 on. One that
does not know a way of asking says so, which is left unread."""


class GpsUbxParams(Params):
    source: LiveSource = Field(
        default="/dev/ttyACM0",
        description="/dev/tty… or COM3: a serial port; tcp://host:port: one that another computer passes on; "
        "`fake`: a receiver that is made up, to try it.",
    )
    baud: int = Field(default=38_400, gt=0, description="Speed of the serial port; by USB any will do.")
    silence_s: float = Field(default=10.0, gt=0, description="Open it again when no solution came for so long.")
    ask: bool = Field(default=True, description="Ask the receiver for its solutions; false: it is set up already.")
    corrections: bool = Field(default=False, description="Take RTCM 3 from operators on the label with `_corrections`.")


class GpsUbx(DataChannelSendable[GpsFix]):
    """Sends a position per epoch, also without a fix, and carries the corrections of :class:`RtcmCorrections`."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: GpsUbxParams, link: LineLink) -> None:
        super().__init__(label)
        self.params = params
        self._link = link
        self._complaints = ComplaintPace()

    def messages(self) -> Iterator[GpsFix]:
        try:
            with opened(self.params.source, self.params.baud, self._fake) as source:
                if self.params.ask:
                    source.write(b"".join(message.serialize() for message in _TELL))
                with self._link.carried_by(source):
                    yield from self._read_all(source)
        except OSError as error:
            raise DeviceGone(f"{self.params.source}: {error}") from error

    def _fake(self) -> FakeSource:
        receiver = FakeUbxReceiver()
        return FakeSource(receiver.pieces(), self.pause, receiver.hear)

    def _read_all(self, source: ByteSource) -> Iterator[GpsFix]:
        frames, bad_frames = UbxFrames(), 0
        heard_at_s = self.monotonic_s()
        while not self.is_stopping:
            positions = [one for frame in frames.feed(source.read()) if (one := self._position(frame)) is not None]
            now_s = self.monotonic_s()
            self._refuse(frames.bad_frames - bad_frames, now_s)
            bad_frames = frames.bad_frames
            if self._link.failure is not None:
                raise self._link.failure
            if positions:
                heard_at_s = now_s
            elif now_s - heard_at_s > self.params.silence_s:
                doubt = baud_doubt(self.params.source, self.params.baud)
                raise TimeoutError(f"no solution for {self.params.silence_s:g} s{doubt}")
            yield from positions

    def _position(self, frame: bytes) -> GpsFix | None:
        if frame[2:4] != NAV_PVT:
            return None
        try:
            return fix_of(UBXReader.parse(frame), wall_time_us())
        except (UBXParseError, UBXMessageError, UBXTypeError, AttributeError):  # a payload that is too short
            self._refuse(1, self.monotonic_s())
            return None

    def _refuse(self, frames: int, now_s: float) -> None:
        if frames:
            self.count_loss("refused", frames)
            if self._complaints.is_due("refused", now_s):
                _log.warning("%s: refused a broken frame of %s", self.label, self.params.source)


class RtcmCorrections(DataChannelReceivable[bytes]):
    """Passes whole RTCM 3 frames on to the receiver, and nothing else."""

    motion_fields: ClassVar[tuple[str, ...]] = ()

    def __init__(self, label: str, link: LineLink) -> None:
        super().__init__(label)
        self._link = link

    def handle_data(self, data: bytes) -> None:
        """Receiver's thread."""
        try:
            self._link.write(checked_frames(data))
        except ValueError as error:
            raise Refused("channel.invalid", str(error)) from None


class GpsUbxConfigurer(DataChannelConfigurer[GpsUbxParams]):
    """Position, accuracy and fix of a u-blox receiver; takes corrections for it."""

    connector_type = "gps-ubx"
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake", "corrections": True}

    def configure(self) -> Sequence[Handler]:
        link = LineLink()
        handlers: list[Handler] = [GpsUbx(self.label, self.params, link)]
        if self.params.corrections:
            handlers.append(RtcmCorrections(f"{self.label}_corrections", link))
        return handlers
