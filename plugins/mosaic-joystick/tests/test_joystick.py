"""The connector: changes are told, silence is none, and a stick that is gone was let go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from support.devices.absence import thirty_seconds

from mosaic_core import DeviceGone
from mosaic_core.testing import build, collect
from mosaic_joystick.joystick import REPEAT_S, JoystickConfigurer

if TYPE_CHECKING:
    from conftest import FakeInput


@pytest.fixture
def stick(joystick: FakeInput, fake_clock: Any) -> Any:
    return build(JoystickConfigurer, params={"dead_zone_percent": 0.0}, clock=fake_clock)


def test_it_is_told_how_the_stick_stands_with_its_names(stick: Any, joystick: FakeInput) -> None:
    joystick.push(1, -512)
    joystick.press(0x120)
    (joy,) = collect(stick, 1)
    assert (joy.axes, joy.buttons) == ([0.0, 1.0, 0.0, 1.0], [1, 0])
    assert joy.axis_names == ["x", "y", "rz", "throttle"]
    assert joy.button_names == ["trigger", "thumb"]
    assert joy.frame_id == "Acme Stick"


def test_what_stays_is_told_twice_a_second(stick: Any, fake_clock: Any) -> None:
    began_s = fake_clock.now_s
    assert len({tuple(joy.axes) for joy in collect(stick, 6)}) == 1
    assert 5 * REPEAT_S <= fake_clock.now_s - began_s <= 5 * REPEAT_S + 0.2


class AtTime:
    """Something that happens to the stick while it is watched."""

    def __init__(self, at_s: float, act: Any) -> None:
        self.due_at_s: float | None = at_s
        self._act = act

    def ring(self, now_s: float) -> None:
        self.due_at_s = None
        self._act()


def test_a_change_is_told_at_the_next_look(stick: Any, joystick: FakeInput, fake_clock: Any) -> None:
    began_s = fake_clock.now_s
    fake_clock.watch(AtTime(began_s + 0.1, lambda: joystick.press(0x121)))
    assert [joy.buttons for joy in collect(stick, 2)] == [[0, 0], [0, 1]]
    assert fake_clock.now_s - began_s < 0.1 + 0.05


def test_a_stick_that_is_unplugged_for_thirty_seconds_is_told_as_let_go_before_it_is_gone(
    stick: Any, joystick: FakeInput, fake_clock: Any
) -> None:
    joystick.press(0x120)
    joystick.push(0, -512)
    fake_clock.watch(AtTime(fake_clock.now_s + 0.1, joystick.unplug))
    messages = stick.messages()
    assert next(messages).buttons == [1, 0]
    assert (last := next(messages)).buttons == [0, 0]
    assert last.axes == [0.0, 0.0, 0.0, 0.0]
    with pytest.raises(DeviceGone, match="is gone"):
        next(messages)
    for _ in thirty_seconds(fake_clock):
        with pytest.raises(DeviceGone, match="there is no stick"):
            collect(stick, 1)
    joystick.pressed.clear()
    joystick.plug()
    assert collect(stick, 1)[0].buttons == [0, 0]


def test_a_stick_that_is_made_up_is_moved_about() -> None:
    told = collect(build(JoystickConfigurer, params={"stick": "fake"}), 3)
    assert all(len(joy.axes) == 3 and min(joy.axes) >= -1 and max(joy.axes) <= 1 for joy in told)
