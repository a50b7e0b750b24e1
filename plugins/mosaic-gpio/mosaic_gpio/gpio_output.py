"""The ``gpio-output`` connector: switches or dims what hangs on a pin; silence or a lost operator makes it safe."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, FieldBounds, Message
from mosaic_core.contract.params import unit
from mosaic_gpio.factories import PinParams, factory_of
from mosaic_gpio.kept_pin import KeptPin, shared_pin

TIMEOUT_S = 1.0
"""What hangs on the pin is not known here, and may move: whoever wants a lamp to stay on says more in the file."""


class GpioOutputParams(PinParams):
    pwm: bool = Field(default=False, description="Dim it, instead of switching it.")
    frequency_hz: float = Field(default=200.0, gt=0, le=8000, description="Of its pulses, with pwm.")
    active_low: bool = Field(default=False, description="It is on when the pin is low.")
    safe_value: float = Field(
        default=0.0, ge=0, le=1, description="From the robot's start, on silence, on a stop, at the end: 0 off, 1 on.",
        json_schema_extra=unit(""),
    )  # fmt: skip


class OutputTarget(Message):
    """What a pin shall do."""

    value: float = Field(
        ge=0, le=1, description="0 off, 1 on; between them dimmed, or without pwm on from 0.5.",
        json_schema_extra=unit(""),
    )  # fmt: skip


class GpioOutput(DataChannelReceivable[OutputTarget]):
    """Writes a pin. Its value is limited as a position is: where 1 holds a brake open, 0 is no standstill."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    position_fields: ClassVar[tuple[str, ...]] = ("value",)
    timeout_s = TIMEOUT_S
    requires_lease = True

    def __init__(self, label: str, pin: KeptPin, params: GpioOutputParams) -> None:
        super().__init__(label)
        self._pin, self.keeper = pin, pin.keeper
        self._params = params
        self.limits = {"value": FieldBounds(min=0.0, max=1.0)}

    def reported_position(self, field: str) -> float | None:
        return self._pin.value

    def handle_data(self, data: OutputTarget) -> None:
        """Receiver's thread."""
        self._pin.write(_level(self._params, data.value))

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._pin.write(_level(self._params, self._params.safe_value))


def _level(params: GpioOutputParams, value: float) -> float:
    return value if params.pwm else float(value >= 0.5)


def _device(params: GpioOutputParams) -> Any:
    from gpiozero import DigitalOutputDevice, PWMOutputDevice

    factory, safe = factory_of(params.source), _level(params, params.safe_value)
    if params.pwm:
        return PWMOutputDevice(
            params.pin, active_high=not params.active_low, initial_value=safe, frequency=params.frequency_hz,
            pin_factory=factory,
        )  # fmt: skip
    return DigitalOutputDevice(
        params.pin, active_high=not params.active_low, initial_value=bool(safe), pin_factory=factory
    )


class GpioOutputConfigurer(DataChannelConfigurer[GpioOutputParams]):
    """Switches or dims what hangs on a pin; it goes to its safe value on silence and when the operator leaves."""

    connector_type = "gpio-output"
    example: ClassVar[dict[str, Any] | None] = {"pin": 27}
    trial: ClassVar[dict[str, Any] | None] = {"pin": 27, "source": "fake"}

    def configure(self) -> GpioOutput:
        params = self.params
        safe = _level(params, params.safe_value)
        pin = shared_pin(
            self.shared, params, self.label, lambda: KeptPin(params, lambda: _device(params), "value", safe)
        )
        return GpioOutput(self.label, pin, params)
