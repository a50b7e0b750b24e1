"""Writes commands and safe values into one device, in an order that keeps it safe."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from mosaic_core.words.errors import DeviceGone, Refused
from mosaic_modbus.kept_line import KeptLine
from mosaic_modbus.numbers import encoded
from mosaic_modbus.params import WriteField
from mosaic_modbus.plan import Write, writes_of
from mosaic_modbus.port import DeviceSaidNo

FieldValue = float | bool


class SafeWriter:
    """Two threads meet here and on the line: the *receiver's* writes commands, the *safety* thread and the line's own
    write the safe values. While it ``owes`` them, no command is written."""

    def __init__(self, line: KeptLine, device_id: int, fields: Mapping[str, WriteField]) -> None:
        self._line, self.keeper = line, line.keeper
        self._device_id = device_id
        self._fields = fields
        self._safe = list(
            writes_of(fields, {name: encoded(fields[name], value) for name, value in safe_values(fields)})
        )
        self._times_safe = 0
        self.owes = False
        self._why_owed = "the line is being opened"
        if self._safe:
            line.begins_and_ends_with(self)

    def command(self, values: Mapping[str, FieldValue]) -> None:
        """Write ``values``, what touches in one request. Receiver's thread. Raises :class:`Refused`; then the device is
        made safe if a part was written."""
        if self.owes:
            raise Refused("plugin.no_device", f"the safe values have not been written yet: {self._why_owed}")
        times_safe = self._times_safe

        def check_order() -> None:
            if self._times_safe != times_safe:
                raise Refused("safety.stopped", "the device was made safe meanwhile")

        for write in writes_of(self._fields, self._words(values)):
            self._write(write, check_order)

    def _words(self, values: Mapping[str, FieldValue]) -> dict[str, Sequence[int]]:
        try:
            return {name: encoded(self._fields[name], value) for name, value in values.items()}
        except ValueError as error:
            raise Refused("safety.out_of_range", str(error)) from error

    def _write(self, write: Write, check: Callable[[], None]) -> None:
        try:
            self._line.write(self._device_id, write, check=check)
        except DeviceGone as error:
            self._owe()
            raise Refused("plugin.no_device", error.message) from error
        except DeviceSaidNo as error:
            self._owe()
            raise Refused("plugin.no_device", f"device {self._device_id} refused {write}: {error}") from error

    def _owe(self) -> None:
        """What the device does now is not known."""
        if self._safe:
            self.owes = True
            self._line.wake()

    def make_safe(self) -> None:
        """Write the safe values now; while the line is away they are owed, and written first. Safety thread."""
        if not self._safe:
            return
        try:
            self.pay()
        except (DeviceGone, DeviceSaidNo):
            self._owe()

    def pay(self) -> None:
        """Write the safe values. Raises :class:`DeviceGone`, :class:`DeviceSaidNo`."""
        self._times_safe += 1
        try:
            for write in self._safe:
                self._line.write(self._device_id, write, urgently=True)
        except (DeviceGone, DeviceSaidNo) as error:
            self._why_owed = str(error)
            raise
        self.owes = False


def safe_values(fields: Mapping[str, WriteField]) -> list[tuple[str, FieldValue]]:
    """What is safe: as each field says, and 0 for a velocity that says nothing."""
    said = [(name, one.safe) for name, one in fields.items() if one.safe is not None]
    return said + [(name, 0.0) for name, one in fields.items() if one.safe is None and one.motion == "velocity"]
