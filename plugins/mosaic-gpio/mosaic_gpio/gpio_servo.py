"""The ``gpio-servo`` connector: turns a hobby servo on a pin; silence or a lost operator leaves it where it is."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, FieldBounds
from mosaic_core.messages import JointTarget
from mosaic_gpio.factories import PinParams, factory_of
from mosaic_gpio.kept_pin import KeptPin, shared_pin

TIMEOUT_S = 1.0


class GpioServoParams(PinParams):
    joint: str = Field(default="servo", min_length=1, max_length=64, description="Its name in JointTarget.")
    min_rad: float = Field(
        default=-math.pi / 4, ge=-math.pi, le=math.pi, description="Where the shortest pulse turns it."
    )
    max_rad: float = Field(
        default=math.pi / 4, ge=-math.pi, le=math.pi, description="Where the longest pulse turns it."
    )
    min_pulse_s: float = Field(default=0.001, ge=0.0003, le=0.0029, description="The shortest pulse.")
    max_pulse_s: float = Field(default=0.002, ge=0.0004, le=0.003, description="The longest pulse.")
    start_rad: float | None = Field(
        default=None, description="Where it is taken to be before its first command; it can't tell. None: unknown."
    )

    @model_validator(mode="after")
    def _are_in_order(self) -> Self:
        if self.min_rad >= self.max_rad or self.min_pulse_s >= self.max_pulse_s:
            raise ValueError("min_rad and min_pulse_s must be below max_rad and max_pulse_s")
        if self.start_rad is not None and not self.min_rad <= self.start_rad <= self.max_rad:
            raise ValueError("start_rad must be between min_rad and max_rad")
        return self


class GpioServo(DataChannelReceivable[JointTarget]):
    """Turns one servo. It gets no pulse, and so does not move, before the first command."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    timeout_s = TIMEOUT_S
    requires_lease = True

    def __init__(self, label: str, pin: KeptPin, params: GpioServoParams) -> None:
        super().__init__(label)
        self._pin, self.keeper = pin, pin.keeper
        self._start_rad = params.start_rad
        self.item_names = (params.joint,)
        self.limits = {f"positions.{params.joint}": FieldBounds(min=params.min_rad, max=params.max_rad)}

    def reported_position(self, field: str) -> float | None:
        """What it was told last, for it says nothing itself."""
        angle_deg = self._pin.value
        return self._start_rad if angle_deg is None else math.radians(angle_deg)

    def handle_data(self, data: JointTarget) -> None:
        """Receiver's thread."""
        for angle_rad in data.positions:
            self._pin.write(math.degrees(angle_rad))

    def make_safe(self, cause: str) -> None:
        """Safety thread. It stays where it was told to be, and its pulses go on: without them what it carries falls."""


def _device(params: GpioServoParams) -> Any:
    from gpiozero import AngularServo

    return AngularServo(
        params.pin, initial_angle=None, min_angle=math.degrees(params.min_rad), max_angle=math.degrees(params.max_rad),
        min_pulse_width=params.min_pulse_s, max_pulse_width=params.max_pulse_s, pin_factory=factory_of(params.source),
    )  # fmt: skip


class GpioServoConfigurer(DataChannelConfigurer[GpioServoParams]):
    """Turns a hobby servo on a pin within its limits; it stays where it is on silence and when the operator leaves."""

    connector_type = "gpio-servo"
    example: ClassVar[dict[str, Any] | None] = {"pin": 18, "joint": "pan"}
    trial: ClassVar[dict[str, Any] | None] = {"pin": 18, "joint": "pan", "source": "fake", "start_rad": 0.0}

    def configure(self) -> GpioServo:
        params = self.params
        pin = shared_pin(
            self.shared, params, self.label, lambda: KeptPin(params, lambda: _device(params), "angle", None)
        )
        return GpioServo(self.label, pin, params)
