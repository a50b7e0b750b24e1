"""Pins over gpiozero's mock: what is told, what acts, and what is safe."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from typing import Any

import pytest
from gpiozero import Device, DigitalOutputDevice
from gpiozero.pins.mock import MockFactory, MockPWMPin
from hypothesis import given
from hypothesis import strategies as st
from support.devices.absence import hasty, tries_in_thirty_seconds
from support.waiting import wait_for

from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.testing import Leaves, Silence, Stopped, build, collect, fake_host, feed
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_gpio import kept_pin
from mosaic_gpio.debounce import Debounce
from mosaic_gpio.gpio_input import GpioInput, GpioInputConfigurer
from mosaic_gpio.gpio_output import GpioOutput, GpioOutputConfigurer
from mosaic_gpio.gpio_servo import GpioServo, GpioServoConfigurer

OPENS_S = 5.0


@pytest.fixture
def pins(monkeypatch: pytest.MonkeyPatch) -> Iterator[MockFactory]:
    factory = MockFactory(pin_class=MockPWMPin)
    monkeypatch.setattr(Device, "pin_factory", factory)
    yield factory
    factory.close()


def told(handler: GpioInput) -> list[bool]:
    return [one["is_on"] for one in fake_host(handler).sent_values()]


def test_edges_on_the_thread_of_the_driver_are_told_at_once_and_bounces_are_thinned(
    pins: MockFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    button = build(GpioInputConfigurer, params={"pin": 17, "debounce_s": 0.03})
    host, pin, ticks = fake_host(button), pins.pin(17), []

    def wait(seconds: float) -> bool:
        host.clock.advance(seconds)
        ticks.append(seconds)
        if len(ticks) == 2:
            for _ in range(100):  # a contact that bounces, and ends pressed
                pin.drive_low()
                pin.drive_high()
            pin.drive_low()
        return len(ticks) == 6

    host.arm()
    monkeypatch.setattr(host, "wait", wait)
    assert list(button.messages()) == []
    assert told(button) == [False, True]
    assert host.losses["thinned"] == 100
    assert fake_host(button).sent_values()[-1]["changes"] == 1


@pytest.mark.parametrize(
    ("params", "is_on"),
    [({"pull": "up"}, False), ({"pull": "down"}, False), ({"pull": "up", "active_low": False}, True)],
)
def test_pull_and_active_low_say_what_on_is(pins: MockFactory, params: dict[str, Any], is_on: bool) -> None:
    button = build(GpioInputConfigurer, params={"pin": 17, **params})
    collect(button, within_s=0.01)
    assert told(button)[0] is is_on


def test_the_finger_that_is_made_up_presses_and_lets_go() -> None:
    button = build(GpioInputConfigurer, params={"pin": 17, "source": "fake"})
    collect(button, within_s=3.0)
    assert set(told(button)) == {True, False}


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 10))))
def test_nothing_is_told_twice_or_within_the_quiet_time_and_the_end_is_always_told(
    edges: list[tuple[bool, int]],
) -> None:
    state, now_s, tells, level = Debounce(3, is_on=False), 0, [(-3, False)], False
    for level, after_s in edges:
        now_s += after_s
        if state.changed(level, now_s):
            tells.append((now_s, level))
    if state.changed(level, now_s + 3):
        tells.append((now_s + 3, level))
    assert all(a[1] != b[1] and b[0] - a[0] >= 3 for a, b in pairwise(tells))
    assert tells[-1][1] == level


def test_a_pin_that_somebody_has_and_a_machine_without_pins_are_told_with_the_cure(
    pins: MockFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    button = build(GpioInputConfigurer, params={"pin": 17})
    with closing(DigitalOutputDevice(17)), pytest.raises(DeviceGone, match=r"GPIO17 is in use.*one connector"):
        collect(button, 1, within_s=1)
    with pytest.raises(DeviceGone, match="GPIO53 can't be had"):
        collect(build(GpioInputConfigurer, params={"pin": 53}), within_s=1)
    monkeypatch.setattr(Device, "pin_factory", None)
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "nowhere")
    with pytest.raises(DeviceGone, match="pip install lgpio"):
        collect(button, within_s=1)


def test_an_input_whose_pin_fails_for_thirty_seconds_is_gone_and_then_told_again(
    pins: MockFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    button = build(GpioInputConfigurer, params={"pin": 17})
    host = fake_host(button)
    host.arm()

    def fails(pin: Any) -> bool:
        raise OSError("bad file descriptor")

    def breaks(seconds: float) -> None:
        monkeypatch.setattr(MockPWMPin, "_get_state", fails)

    with monkeypatch.context() as broken:
        broken.setattr(host, "wait", breaks)
        with pytest.raises(DeviceGone, match="GPIO17: OSError: bad file descriptor"):
            list(button.messages())
        for _ in range(6):  # as the robot tries again
            host.clock.advance(5.0)
            with pytest.raises(DeviceGone, match="GPIO17: OSError: bad file descriptor"):
                list(button.messages())
    monkeypatch.undo()
    monkeypatch.setattr(Device, "pin_factory", pins)
    assert told(button) == [False]
    collect(button, within_s=0.1)
    assert told(button) == [False, False]


def output(shared: Shared, **params: Any) -> GpioOutput:
    return build(GpioOutputConfigurer, params={"pin": 27, **params}, shared=shared)


def test_an_output_is_safe_from_the_start_acts_and_is_safe_after_silence_and_at_the_end(pins: MockFactory) -> None:
    shared, pin = Shared(), pins.pin(27)
    lamp = output(shared, safe_value=1)
    with shared.entered():
        assert lamp._pin.wait_open(OPENS_S)
        assert pin.state == 1
        feed(lamp, [{"value": 0}])
        assert pin.state == 0
        fed = feed(lamp, [{"value": 0}, Silence(1.5)])
        assert [one.cause for one in fed.made_safe] == ["safety.timeout"]
        assert pin.state == 1
        feed(lamp, [{"value": 0}])
        told_before = len(pin.states)
    assert pin.states[told_before].state == 1  # before it is closed, which makes it an input


@pytest.mark.parametrize("step", [Leaves(), Stopped()])
def test_a_stop_and_who_leaves_make_an_output_safe(pins: MockFactory, step: Any) -> None:
    shared = Shared()
    lamp = output(shared, pwm=True)
    with shared.entered():
        assert lamp._pin.wait_open(OPENS_S)
        feed(lamp, [{"value": 0.25}, step])
        assert pins.pin(27).state == 0


def test_a_dimmed_output_takes_any_share_and_refuses_garbage(pins: MockFactory) -> None:
    shared = Shared()
    lamp = output(shared, pwm=True)
    with shared.entered():
        assert lamp._pin.wait_open(OPENS_S)
        fed = feed(lamp, [{"value": 0.25}, "{", {"value": "on"}, {"value": None}, b"\xff"])
        assert len(fed.refused) == 4
        assert pins.pin(27).state == 0.25


LIT: dict[str, Any] = {"value": 1}
TURNED: dict[str, Any] = {"names": ["pan"], "positions": [0.5]}


@pytest.mark.parametrize(
    ("configurer", "params", "command"),
    [(GpioOutputConfigurer, {"pin": 27}, LIT), (GpioServoConfigurer, {"pin": 27, "joint": "pan"}, TURNED)],
)
def test_a_pin_that_fails_for_thirty_seconds_is_refused_until_it_is_opened_again_in_its_safe_state(
    pins: MockFactory, monkeypatch: pytest.MonkeyPatch, configurer: Any, params: Any, command: Any
) -> None:
    often = tries_in_thirty_seconds(RETRY)
    monkeypatch.setattr(kept_pin, "RETRY", hasty(RETRY))
    shared, pin = Shared(), pins.pin(27)
    handler = build(configurer, params=params, shared=shared)
    tries: list[Any] = []

    def fail(self: Any, value: Any) -> None:
        tries.append(value)
        raise OSError(5, "Input/output error")

    with shared.entered():
        assert handler._pin.wait_open(OPENS_S)
        assert feed(handler, [command]).refused == []
        assert pin.state
        with monkeypatch.context() as broken:
            broken.setattr(type(pin), "_set_state", fail)
            wait_for(lambda: feed(handler, [command]).refused and len(tries) > often, "it is tried again and again")
            assert [one.code for one in feed(handler, [command]).refused] == ["plugin.no_device"]
        assert handler._pin.wait_open(OPENS_S)
        assert handler._pin.keeper.absence is None
        assert not pin.state
        assert feed(handler, [command]).refused == []
        assert pin.state


def test_a_servo_turns_within_its_range_and_stays_after_silence(pins: MockFactory) -> None:
    shared = Shared()
    servo: GpioServo = build(GpioServoConfigurer, params={"pin": 18, "joint": "pan"}, shared=shared)
    with shared.entered():
        assert servo._pin.wait_open(OPENS_S)
        assert servo.reported_position("positions.pan") is None
        feed(servo, [{"names": ["pan"], "positions": [9.0]}, Silence(2.0)])
        assert servo.reported_position("positions.pan") == pytest.approx(math.pi / 4)
        assert len(feed(servo, [{"names": ["tilt"], "positions": [0.1]}]).refused) == 1


def test_a_pin_that_is_not_there_refuses_with_the_cure_in_the_log(
    pins: MockFactory, caplog: pytest.LogCaptureFixture
) -> None:
    shared = Shared()
    lamp = output(shared)
    with closing(DigitalOutputDevice(27)), shared.entered():
        while not caplog.records:  # the thread that opens it tells it once
            assert not lamp._pin.wait_open(0.01)
        assert [one.code for one in feed(lamp, [{"value": 1}]).refused] == ["plugin.no_device"]
        assert lamp._pin.keeper.absence is not None, "and so it is shown to everybody"
    assert "GPIO27 is in use" in caplog.text
    assert "Give each pin to one connector" in caplog.text


def test_a_servo_that_is_taken_to_be_somewhere_begins_there(pins: MockFactory) -> None:
    shared = Shared()
    limits = {"limits": {"positions.pan": {"max_rate_per_s": 0.5}}}
    params = {"pin": 18, "joint": "pan", "start_rad": 0.2}
    servo = build(GpioServoConfigurer, params=params, safety=limits, shared=shared)
    with shared.entered():
        assert servo._pin.wait_open(OPENS_S)
        feed(servo, [{"names": ["pan"], "positions": [0.7]}])
        at_rad = servo.reported_position("positions.pan")
        assert at_rad is not None
        assert 0.2 <= at_rad <= 0.26


@pytest.mark.parametrize(
    ("configurer", "params"),
    [
        (GpioInputConfigurer, {"pin": 99}),
        (GpioInputConfigurer, {"pin": 17, "debounce_s": 0}),
        (GpioOutputConfigurer, {"pin": 17, "safe_value": 2}),
        (GpioServoConfigurer, {"pin": 17, "min_rad": 1, "max_rad": 0}),
        (GpioServoConfigurer, {"pin": 17, "start_rad": 2}),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(configurer: Any, params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        build(configurer, params=params)
