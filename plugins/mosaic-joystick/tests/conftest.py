"""A kernel that is made up: input devices that answer its requests and whose events come byte by byte."""

from __future__ import annotations

import copy
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from mosaic_joystick import event_device, sticks
from mosaic_joystick.event_device import EVENT
from mosaic_joystick.input_codes import ABS, KEY, REL, SYN


@dataclass
class FakeInput:
    """One input device of the kernel. ``axes``: code → value, least, most, flat."""

    path: Path
    name: str = "Acme Stick"
    vendor: int = 0x1234
    product: int = 1
    axes: dict[int, tuple[int, int, int, int]] = field(default_factory=dict)
    rel_axes: tuple[int, ...] = ()
    buttons: tuple[int, ...] = ()
    pressed: set[int] = field(default_factory=set)
    writer: int = -1

    def plug(self) -> None:
        os.mkfifo(self.path)
        self.writer = os.open(self.path, os.O_RDWR | os.O_NONBLOCK)

    def unplug(self) -> None:
        os.close(self.writer)
        self.path.unlink()

    def tell(self, *events: tuple[int, int, int]) -> None:
        """Events, and the end of their report."""
        os.write(self.writer, b"".join(EVENT.pack(0, 0, *event) for event in (*events, (SYN, 0, 0))))

    def push(self, code: int, value: int) -> None:
        _, least, most, flat = self.axes[code]
        self.axes[code] = (value, least, most, flat)
        self.tell((ABS, code, value))

    def press(self, code: int, *, down: bool = True) -> None:
        (self.pressed.add if down else self.pressed.discard)(code)
        self.tell((KEY, code, int(down)))

    def answer(self, number: int) -> bytes:
        if number >= 0x40:
            value, least, most, flat = self.axes[number - 0x40]
            return struct.pack("@6i", value, least, most, 0, flat, 0)
        answers = {
            0x02: struct.pack("@4H", 3, self.vendor, self.product, 1), 0x06: self.name.encode() + b"\0",
            0x18: mask(self.pressed), 0x20 + KEY: mask(self.buttons), 0x20 + REL: mask(self.rel_axes),
            0x20 + ABS: mask(self.axes),
        }  # fmt: skip
        return answers[number]


def mask(numbers: object) -> bytes:
    bits = sum(1 << number for number in numbers)  # type: ignore[attr-defined]
    return bits.to_bytes(96, "little")


class FakeKernel:
    """All input devices of a machine."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.inputs: dict[str, FakeInput] = {}

    def plug(self, number: int, **what: object) -> FakeInput:
        one = FakeInput(self.folder / f"event{number}", **what)  # type: ignore[arg-type]
        one.plug()
        self.inputs[str(one.path)] = one
        return one

    def ioctl(self, file: int, request: int, answer: bytearray) -> None:
        one = self.inputs[str(Path(f"/proc/self/fd/{file}").readlink()).removesuffix(" (deleted)")]
        said = one.answer(request & 0xFF)[: len(answer)]
        assert request == 2 << 30 | len(answer) << 16 | 0x4500 | request & 0xFF
        answer[: len(said)] = said


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeKernel:
    made = FakeKernel(tmp_path)
    monkeypatch.setattr(event_device, "_kernel", made.ioctl)
    monkeypatch.setattr(sticks, "INPUT", tmp_path)
    return made


JOYSTICK: dict[str, object] = {
    "axes": {0: (0, -512, 511, 16), 1: (0, -512, 511, 16), 5: (128, 0, 255, 8), 6: (255, 0, 255, 0)},
    "buttons": (0x120, 0x121),
}
"""Three axes, a throttle and two buttons."""
KEYBOARD: dict[str, object] = {"name": "Acme Keyboard", "buttons": tuple(range(1, 100))}


@pytest.fixture
def joystick(kernel: FakeKernel) -> FakeInput:
    return kernel.plug(3, **copy.deepcopy(JOYSTICK))
