"""The ``gpio-input`` connector: whether a button, an end switch or any other contact is on."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message
from mosaic_core.messages import wall_time_us
from mosaic_gpio.debounce import Debounce
from mosaic_gpio.factories import PinParams, factory_of, opening

FAKE_PRESS_S = 1.0
PULLS = {"up": True, "down": False, "none": None}
_SAMPLE_S = 0.05
"""How often a pin is also looked at, though its edges come by themselves: one may have been lost, or ended a bounce."""


class GpioInputParams(PinParams):
    pull: Literal["up", "down", "none"] = Field(
        default="up", description="The resistor inside; up for a contact to ground."
    )
    active_low: bool | None = Field(default=None, description="It is on when the pin is low; default: with pull up.")
    debounce_s: float = Field(default=0.01, ge=0.001, le=1, description="After a change none is told for so long.")


class InputState(Message):
    """How an input stands."""

    is_on: bool
    changes: int = Field(ge=0, description="So many were told since the pin was opened.")
    timestamp: int = Field(description="In µs since 1970, by the robot's clock.")


class GpioInput(DataChannelSendable[InputState]):
    """Sends each change of a pin as it happens, on gpiozero's thread, and how it stands when it is opened."""

    def __init__(self, label: str, params: GpioInputParams) -> None:
        super().__init__(label)
        self.params = params
        self._lock = threading.Lock()

    def messages(self) -> Iterator[InputState]:
        params = self.params
        low_is_on = params.pull == "up" if params.active_low is None else params.active_low
        with _opened(params) as device:
            with opening(params):
                state = Debounce(params.debounce_s, is_on=device.pin.state != low_is_on)

            def seen() -> None:
                with self._lock:
                    self._told(state, device.pin.state != low_is_on)

            device.when_activated = device.when_deactivated = seen
            with self._lock:
                self.send_json(_message(state))
            for _ in self.every(min(_SAMPLE_S, max(params.debounce_s, 0.01))):
                if params.source == "fake":
                    _press(device, self.monotonic_s())
                with opening(params):
                    seen()
        yield from ()

    def _told(self, state: Debounce, is_on: bool) -> None:
        if state.changed(is_on, self.monotonic_s()):
            self.send_json(_message(state))
        elif is_on != state.is_on:
            self.count_loss("thinned")


def _message(state: Debounce) -> InputState:
    return InputState(is_on=state.is_on, changes=state.changes, timestamp=wall_time_us())


def _press(device: Any, now_s: float) -> None:
    """The finger that is made up: on for a second, off for a second."""
    device.pin.drive_high() if int(now_s / FAKE_PRESS_S) % 2 else device.pin.drive_low()


@contextmanager
def _opened(params: GpioInputParams) -> Iterator[Any]:
    from gpiozero import DigitalInputDevice

    pull = PULLS[params.pull]
    with opening(params):
        device = DigitalInputDevice(
            params.pin, pull_up=pull, active_state=True if pull is None else None, pin_factory=factory_of(params.source)
        )
    try:
        yield device
    finally:
        device.close()


class GpioInputConfigurer(DataChannelConfigurer[GpioInputParams]):
    """Tells whether a button or switch on a pin is on, as soon as it changes."""

    connector_type = "gpio-input"
    example: ClassVar[dict[str, Any] | None] = {"pin": 17}
    trial: ClassVar[dict[str, Any] | None] = {"pin": 17, "source": "fake"}

    def configure(self) -> GpioInput:
        return GpioInput(self.label, self.params)
