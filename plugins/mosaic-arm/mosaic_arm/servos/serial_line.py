"""The serial line of a bus: an instruction goes out, the replies of one or several motors come in."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Self

import serial

from mosaic_arm.servos.packets import PacketFormat, ServoReply
from mosaic_core import DeviceGone

QUIET_S = 0.02
"""Nobody answers any more after so much silence: an FTDI adapter keeps bytes back for 16 ms."""
WRITE_S = 0.5
"""A port that takes a packet no sooner is broken. Less would take a busy machine for one: pyserial looks at the clock
also behind the last byte."""
_POLL_S = 0.005
_BITS_PER_BYTE = 10


class SerialLine:
    """Owns the port between enter and exit. One thread at a time. Raises :class:`DeviceGone` for whatever fails."""

    def __init__(self, form: PacketFormat, port: str, baud: int) -> None:
        self.form = form
        self.port = port
        self._baud = baud
        self._serial: serial.Serial | None = None

    def __enter__(self) -> Self:
        try:
            self._serial = serial.serial_for_url(
                self.port, baudrate=self._baud, timeout=_POLL_S, write_timeout=WRITE_S, exclusive=True
            )
        except (OSError, ValueError) as error:
            cure = "Plug it in, name the port it has now, and let nobody else use it; you must be in the group dialout."
            raise DeviceGone(f"the port {self.port} can't be opened ({error})", cure) from error
        return self

    def __exit__(self, *_: object) -> None:
        if self._serial is not None:
            self._serial.close()
            self._serial = None

    def say(self, packet: bytes) -> None:
        """Send what nobody answers."""
        port = self._opened()
        try:
            port.write(packet)
        except OSError as error:
            raise self._gone(error) from error

    def ask(self, packet: bytes, motors: Iterable[int], data_bytes: int = 0) -> dict[int, ServoReply]:
        """The replies of ``motors`` with so much data each; of those that do not answer there are none. Whatever came
        in before is thrown away, so that no reply is taken for another question's."""
        waited, port = set(motors), self._opened()
        bytes_in = len(waited) * (data_bytes + self.form.overhead) + len(packet)
        ends_at_s = time.monotonic() + QUIET_S + bytes_in * _BITS_PER_BYTE / self._baud
        stream, found = bytearray(), dict[int, ServoReply]()
        try:
            port.read(port.in_waiting)
            port.write(packet)
            while waited and time.monotonic() < ends_at_s:
                arrived = port.read(max(1, port.in_waiting))
                stream += arrived
                while (reply := self.form.taken_reply(stream)) is not None:
                    if reply.motor in waited and len(reply.data) == data_bytes:
                        found[reply.motor] = reply
                        waited.discard(reply.motor)
        except OSError as error:
            raise self._gone(error) from error
        return found

    def _opened(self) -> serial.Serial:
        if self._serial is None:
            raise DeviceGone(f"the port {self.port} is closed")
        return self._serial

    def _gone(self, error: OSError) -> DeviceGone:
        return DeviceGone(f"the port {self.port} is lost ({error})", "Look at the plug and the supply of the arm.")
