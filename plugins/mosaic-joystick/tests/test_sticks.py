"""Which sticks there are, how they stand, and that no stick is believed that is gone."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core import DeviceGone
from mosaic_joystick.axis import REL_HOLDS_S, Axis, behind
from mosaic_joystick.event_device import EVENT, EventDevice, bits
from mosaic_joystick.input_codes import ABS, KEY, REL, SYN, SYN_DROPPED, kind_of
from mosaic_joystick.stick_state import InputEvent, StickState
from mosaic_joystick.sticks import found_sticks, opened

if TYPE_CHECKING:
    from conftest import FakeInput, FakeKernel

GAMEPAD: dict[str, Any] = {
    "name": "Acme Pad", "axes": {0: (0, -32768, 32767, 128), 1: (0, -32768, 32767, 128), 2: (0, 0, 255, 0)},
    "buttons": (0x130, 0x136),
}  # fmt: skip
MOUSE_3D: dict[str, Any] = {
    "name": "3Dconnexion SpaceMouse", "vendor": 0x256F, "product": 0xC635, "rel_axes": tuple(range(6)),
    "buttons": (0x100, 0x101),
}  # fmt: skip


def test_sticks_are_found_among_keyboards_mice_and_touch_pads(kernel: FakeKernel, joystick: FakeInput) -> None:
    kernel.plug(0, name="Acme Keyboard", buttons=tuple(range(1, 100)))
    kernel.plug(1, name="Acme Mouse", rel_axes=(0, 1, 8), buttons=(0x110, 0x111))
    kernel.plug(2, name="Acme Touch", axes={0: (0, 0, 1000, 0), 1: (0, 0, 1000, 0)}, buttons=(0x14A,))
    kernel.plug(12, **GAMEPAD)
    kernel.plug(5, **MOUSE_3D)
    found = {one.name: one for one in found_sticks()}
    assert {name: one.kind for name, one in found.items()} == {
        "Acme Stick": "joystick", "3Dconnexion SpaceMouse": "3D mouse", "Acme Pad": "gamepad",
    }  # fmt: skip
    assert [axis.name for axis in found["Acme Stick"].axes] == ["x", "y", "rz", "throttle"]
    assert list(found["Acme Stick"].buttons.values()) == ["trigger", "thumb"]
    assert [axis.name for axis in found["3Dconnexion SpaceMouse"].axes] == ["x", "y", "z", "rx", "ry", "rz"]
    assert list(found["3Dconnexion SpaceMouse"].buttons.values()) == ["button_00", "button_01"]
    assert [axis.is_one_sided for axis in found["Acme Pad"].axes] == [False, False, True]


def test_ahead_and_left_are_positive_and_a_throttle_goes_one_way(joystick: FakeInput) -> None:
    with opened("any", 0.0) as stick:
        assert stick.read(0.0).axes == (0.0, 0.0, 0.0, 1.0)
        joystick.push(0, -512)
        joystick.push(1, -512)
        joystick.push(5, 255)
        joystick.push(6, 0)
        assert stick.read(0.1).axes == (1.0, 1.0, -1.0, 0.0)
        joystick.press(0x121)
        assert stick.read(0.2).buttons == (False, True)


def test_a_stick_that_lies_on_its_button_when_it_is_opened_is_seen_so(joystick: FakeInput) -> None:
    joystick.pressed.add(0x120)
    joystick.axes[0] = (511, -512, 511, 16)
    with opened("any", 0.1) as stick:
        assert (stick.read(0.0).axes[0], stick.read(0.0).buttons) == (-1.0, (True, False))


def test_what_the_kernel_could_not_keep_is_asked_for(joystick: FakeInput) -> None:
    with opened("any", 0.0) as stick:
        joystick.press(0x120)
        assert stick.read(0.0).buttons[0]
        joystick.pressed.clear()  # its events are lost
        joystick.tell((SYN, SYN_DROPPED, 0), (KEY, 0x121, 1))
        assert stick.read(0.1).buttons == (False, False)


def test_a_flood_is_read_in_turns(joystick: FakeInput) -> None:
    with opened("any", 0.0) as stick:
        for value in range(1000):
            joystick.tell((ABS, 0, value % 512))
        joystick.tell((ABS, 0, -512))
        assert stick.read(0.0).axes[0] == 1.0


def test_a_3d_mouse_that_says_nothing_more_was_let_go(kernel: FakeKernel) -> None:
    mouse = kernel.plug(1, **MOUSE_3D)
    with opened("space", 0.05) as stick:
        mouse.tell((REL, 1, -350), (REL, 5, -175))
        axes = stick.read(1.0).axes
        assert (axes[1], axes[5]) == (1.0, pytest.approx(0.4737))
        assert stick.read(0.99 + REL_HOLDS_S).axes[1] == 1.0
        assert stick.read(1.01 + REL_HOLDS_S).axes == (0.0,) * 6


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        ("/dev/input/event999", "event999 can't be opened"),
        ("Zebra", "no stick is called 'Zebra'; there are: 'Acme Stick'"),
        ("acme key", "no stick is called"),
    ],
)
def test_a_stick_that_is_not_there_is_told(kernel: FakeKernel, joystick: FakeInput, wanted: str, says: str) -> None:
    kernel.plug(0, name="Acme Keyboard", buttons=(30,))
    with pytest.raises(DeviceGone, match=says), opened(wanted, 0.0):
        pass


def test_what_is_no_stick_is_not_opened_as_one(kernel: FakeKernel) -> None:
    keyboard = kernel.plug(0, name="Acme Keyboard", buttons=(30,))
    with pytest.raises(DeviceGone, match="is no stick"), opened(str(keyboard.path), 0.0):
        pass
    keyboard.unplug()
    with pytest.raises(DeviceGone, match="there is no stick"), opened("any", 0.0):
        pass


def test_unplugged_it_is_gone_and_back_it_is_read_again(joystick: FakeInput) -> None:
    with opened("any", 0.0) as stick:
        joystick.press(0x120)
        joystick.unplug()
        assert stick.read(0.0).buttons[0]  # what was told before
        with pytest.raises(DeviceGone, match="is gone"):
            stick.read(0.0)
    joystick.pressed.clear()
    joystick.plug()
    with opened("any", 0.0) as stick:
        assert stick.read(0.0).buttons == (False, False)


@given(st.binary(max_size=400))
def test_bytes_that_are_no_events_break_nothing(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "noise"
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    writer = os.open(path, os.O_RDWR | os.O_NONBLOCK)
    try:
        with EventDevice(str(path)) as device:
            os.write(writer, data)
            expected = [InputEvent(*one[2:]) for one in EVENT.iter_unpack(data[: len(data) // 24 * 24])]
            if not any((one.kind, one.code) == (SYN, SYN_DROPPED) for one in expected):
                assert device.events() == expected
    finally:
        os.close(writer)


NUMBERS = st.integers(-(2**31), 2**31 - 1)


@given(NUMBERS, NUMBERS, st.floats(0, 0.5), st.booleans())
def test_a_share_is_never_beyond_its_end_whatever_a_device_says(
    value: int, flat: int, dead_zone: float, one_sided: bool
) -> None:
    share = Axis(0, "x", -512, 511, flat, is_one_sided=one_sided).share(value, dead_zone)
    assert (0 if one_sided else -1) <= share <= 1


@given(st.floats(-1, 1), st.floats(0, 0.5))
def test_behind_its_dead_zone_an_axis_begins_at_nought_and_ends_at_one(share: float, dead_zone: float) -> None:
    left = behind(share, dead_zone)
    assert left == -behind(-share, dead_zone)
    assert (left == 0.0) if abs(share) <= dead_zone else abs(left) <= abs(share) + 1e-4
    assert behind(1.0, dead_zone) == 1.0


def test_an_axis_that_nobody_told_of_is_let_go(joystick: FakeInput) -> None:
    stick = next(found_sticks())
    assert StickState(stick, 0.0).reading(0.0).axes == (0.0, 0.0, 0.0, 0.0)


def test_kinds_and_bits() -> None:
    assert bits(b"\x05\x80") == [0, 2, 15]
    assert kind_of(0x046D, 0xC626, (), range(6), ()) == "3D mouse"
    assert kind_of(0x046D, 0xC52B, (), range(6), ()) is None
    assert kind_of(1, 1, (0,), (), (0x120,)) is None
