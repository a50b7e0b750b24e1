"""Reads the kernel's input events of one device (``/dev/input/event*``), as ``linux/input.h`` lays them out.

Written here because evdev, the library for it, has no wheels: it is compiled where it is installed, which needs a
compiler and the kernel's headers on every robot; its author's wheels (evdev-binary) are for x86_64 alone. SDL (pygame)
is meant for gamepads and for a program's main thread.
"""

from __future__ import annotations

import errno
import os
import struct
from typing import Self

from mosaic_core import DeviceGone
from mosaic_joystick.axis import REL_FULL, Axis
from mosaic_joystick.input_codes import (
    ABS,
    AXES,
    BTN_DIGI,
    BTN_TRIGGER,
    KEY,
    PEDALS,
    REL,
    SIX,
    SYN,
    SYN_DROPPED,
    TRIGGERS,
    StickKind,
    button_name,
    kind_of,
)
from mosaic_joystick.stick_state import InputEvent, Stick

EVENT = struct.Struct("@llHHi")
AT_ONCE = 64
"""Events that are read at a time."""
MOST_READS = 32
"""A device that floods is not read for ever; what is left is read in the next turn."""
KEY_BYTES, BIT_BYTES = 96, 8


def _asks(number: int, size_bytes: int) -> int:
    """The number of a request that reads (``_IOC(_IOC_READ, 'E', …)``)."""
    return 2 << 30 | size_bytes << 16 | ord("E") << 8 | number


class EventDevice:
    """Owns the file between enter and exit. One thread at a time. Raises :class:`DeviceGone` for whatever fails."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._file = -1

    def __enter__(self) -> Self:
        try:
            self._file = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            cure = "Plug it in; who may not read it joins the group input (sudo usermod -aG input $USER, log in again)."
            raise DeviceGone(f"{self.path} can't be opened: {error.strerror}", cure) from error
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def stick(self) -> Stick | None:
        """What it is and has; ``None``: no stick."""
        _, vendor, product, _ = struct.unpack("@4H", self._asked(0x02, 8))
        axes, buttons = self._codes(ABS, BIT_BYTES), self._codes(KEY, KEY_BYTES)
        rel_axes = self._codes(REL, BIT_BYTES)
        kind = kind_of(vendor, product, axes, rel_axes, buttons)
        if kind is None:
            return None
        name = self._asked(0x06, 128).split(b"\0")[0].decode(errors="replace") or "without a name"
        is_relative = kind == "3D mouse" and not axes
        found = [self._relative(code) for code in sorted(SIX)] if is_relative else self._axes(kind, axes)
        its_buttons = [one for one in buttons if BTN_TRIGGER <= one < BTN_DIGI or (kind == "3D mouse" and one >= 0x100)]
        return Stick(name, self.path, kind, tuple(found), {code: button_name(code) for code in its_buttons})

    def events(self) -> list[InputEvent]:
        """What has happened since it was asked last; how it stands where the kernel could not keep all. Never waits."""
        found: list[InputEvent] = []
        for _ in range(MOST_READS):
            data = self._read()
            found += [
                InputEvent(*fields[2:]) for fields in EVENT.iter_unpack(data[: len(data) // EVENT.size * EVENT.size])
            ]
            if len(data) < EVENT.size * AT_ONCE:
                break
        has_hole = any(one.kind == SYN and one.code == SYN_DROPPED for one in found)
        return self.standing() if has_hole else found

    def standing(self) -> list[InputEvent]:
        """How all axes and buttons stand now, as events."""
        pressed = set(bits(self._asked(0x18, KEY_BYTES)))
        buttons = [InputEvent(KEY, code, int(code in pressed)) for code in self._codes(KEY, KEY_BYTES)]
        axes = [code for code in self._codes(ABS, BIT_BYTES) if code in AXES]
        return [*buttons, *(InputEvent(ABS, code, self._range(code)[0]) for code in axes)]

    def _axes(self, kind: StickKind, codes: list[int]) -> list[Axis]:
        found = []
        for code in (one for one in codes if one in AXES):
            _, least, most, _, flat, _ = self._range(code)
            is_one_sided = code in PEDALS or (kind == "gamepad" and code in TRIGGERS and least == 0)
            if most > least:
                found.append(Axis(code, AXES[code], least, most, flat, is_one_sided))
        return found

    @staticmethod
    def _relative(code: int) -> Axis:
        return Axis(code, AXES[code], -REL_FULL, REL_FULL, is_relative=True)

    def _range(self, code: int) -> tuple[int, ...]:
        """Value, least, most, fuzz, flat, resolution."""
        return struct.unpack("@6i", self._asked(0x40 + code, 24))

    def _codes(self, kind: int, size_bytes: int) -> list[int]:
        return bits(self._asked(0x20 + kind, size_bytes))

    def _asked(self, number: int, size_bytes: int) -> bytes:
        answer = bytearray(size_bytes)
        try:
            _kernel(self._file, _asks(number, size_bytes), answer)
        except OSError as error:
            raise self._gone(error) from error
        return bytes(answer)

    def _read(self) -> bytes:
        try:
            data = os.read(self._file, EVENT.size * AT_ONCE)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._gone(error) from error
        if not data:
            raise self._gone(OSError(errno.ENODEV, os.strerror(errno.ENODEV)))
        return data

    def _gone(self, error: OSError) -> DeviceGone:
        return DeviceGone(f"{self.path} is gone: {error.strerror}", "Plug it in again, or look at its battery.")


def bits(data: bytes) -> list[int]:
    """The numbers of the bits that are set."""
    return [index for index in range(8 * len(data)) if data[index // 8] >> index % 8 & 1]


def _kernel(file: int, request: int, answer: bytearray) -> None:
    from fcntl import ioctl  # not on Windows, where nothing of this is

    ioctl(file, request, answer)
