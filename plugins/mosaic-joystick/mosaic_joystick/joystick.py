"""The ``joystick`` connector: how a stick on the robot stands, told to operators as ``Joy``. It drives nothing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery, DeviceGone, Params
from mosaic_core.messages import Joy, wall_time_us
from mosaic_joystick.stick_state import Stick, StickReading
from mosaic_joystick.sticks import ANY, opened

REPEAT_S = 0.4
"""A stick that is held still is told so often: whoever acts on it takes silence for a stick that is gone."""


class JoystickParams(Params):
    stick: str = Field(
        default=ANY, min_length=1, max_length=256,
        description="`any`: the first one; a part of its name; its path under /dev/input; `fake`: one that is made up.",
    )  # fmt: skip
    rate_hz: float = Field(default=50.0, ge=1, le=200, description="So often it is looked at; changes are told.")
    dead_zone_percent: float = Field(default=8.0, ge=0, le=50, description="Of each axis, around its middle, is 0.")


class Joystick(DataChannelSendable[Joy]):
    """Sends how a stick stands whenever that changes, and now and then. A stick that is unplugged is let go first."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: JoystickParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[Joy]:
        with opened(self.params.stick, self.params.dead_zone_percent / 100) as its:
            last, told_at_s = None, 0.0
            for _ in self.every(1 / self.params.rate_hz):
                now_s = self.monotonic_s()
                try:
                    reading = its.read(now_s)
                except DeviceGone:
                    yield joy(its.stick, let_go(its.stick))
                    raise
                if reading != last or now_s - told_at_s >= REPEAT_S:
                    last, told_at_s = reading, now_s
                    yield joy(its.stick, reading)


def let_go(stick: Stick) -> StickReading:
    """How a stick stands that nobody touches."""
    return StickReading((0.0,) * len(stick.axes), (False,) * len(stick.buttons))


def joy(stick: Stick, reading: StickReading) -> Joy:
    return Joy(
        axes=list(reading.axes),
        buttons=[int(one) for one in reading.buttons],
        axis_names=[axis.name for axis in stick.axes],
        button_names=list(stick.buttons.values()),
        frame_id=stick.name[:128],
        timestamp=wall_time_us(),
    )


class JoystickConfigurer(DataChannelConfigurer[JoystickParams]):
    """Tells how a joystick, gamepad or 3D mouse that is plugged into the robot stands."""

    connector_type = "joystick"
    example: ClassVar[dict[str, Any] | None] = {"stick": "any"}
    trial: ClassVar[dict[str, Any] | None] = {"stick": "fake"}

    def configure(self) -> Joystick:
        return Joystick(self.label, self.params)
