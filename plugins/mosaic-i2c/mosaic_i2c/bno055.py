"""The ``imu-bno055`` connector: orientation, rotation and acceleration of a Bosch BNO055, which fuses them itself.

Registers, scales and waiting times are those of Bosch's data sheet BST-BNO055-DS000, sections 3 and 4.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.messages import AngularVelocity, Imu, LinearAcceleration, Quaternion, wall_time_us
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import DeviceGone
from mosaic_i2c.bus import Chip, opened
from mosaic_i2c.fake_chips import FakeBno055
from mosaic_i2c.mounting import ImuMounting
from mosaic_i2c.params import ImuParams

CHIP_ID, CHIP_ID_IS = 0x00, 0xA0
ACCELERATION = 0x08
"""From here to the calibration's status there is all that is read: two readings must not mix."""
_GYROSCOPE, _QUATERNION, CALIBRATION = 0x14 - ACCELERATION, 0x20 - ACCELERATION, 0x35
PAGE, UNITS, MODE, POWER = 0x07, 0x3B, 0x3D, 0x3E
CONFIG_MODE = 0x00
MODES = {"ndof": 0x0C, "imu": 0x08}
UNITS_SI = 0x02
"""Acceleration in m/s², rotation in rad/s."""
MODE_CHANGE_S = 0.025
"""19 ms into the configuration, 7 ms out of it."""
_LSB_PER_MPS2, _LSB_PER_RADPS, _LSB_PER_UNIT = 100, 900, 1 << 14
_MAX_READ = 32
"""Of one transfer by SMBus."""


class Bno055Params(ImuParams):
    address: int = Field(default=0x28, ge=0x28, le=0x29, description="0x28, or 0x29 with ADR high.")
    mode: Literal["ndof", "imu"] = Field(
        default="ndof",
        description="ndof: ahead is known by the compass; imu: without it, from where it was switched on.",
    )


class CalibratedImu(Imu):
    """What a BNO055 says, and how well it is calibrated: 0 not at all, 3 fully."""

    calibration_system: int = Field(ge=0, le=3)
    calibration_gyroscope: int = Field(ge=0, le=3)
    calibration_accelerometer: int = Field(ge=0, le=3)
    calibration_magnetometer: int = Field(ge=0, le=3)


class Bno055(DataChannelSendable[CalibratedImu]):
    """Sends what the sensor fuses. One that has lost its settings, as after a break of its power, is set up anew."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: Bno055Params) -> None:
        super().__init__(label)
        self.params = params
        self._mounting = ImuMounting(params.axes)

    def messages(self) -> Iterator[CalibratedImu]:
        with opened(self.params.source, self.params.address, FakeBno055) as chip:
            self._set_up(chip)
            for _ in self.every(1 / self.params.rate_hz):
                message = self._reading(chip)
                if message is not None:
                    yield message

    def _set_up(self, chip: Chip) -> None:
        (found,) = chip.read(CHIP_ID, 1)
        if found != CHIP_ID_IS:
            message = (
                f"{self.params.source}: the chip at {self.params.address:#04x} is no BNO055, its id is {found:#04x}"
            )
            raise DeviceGone(message, "look at the address, or wait until it has started")
        chip.write(PAGE, 0)
        chip.write(MODE, CONFIG_MODE)
        self.pause(MODE_CHANGE_S)
        chip.write(POWER, 0)
        chip.write(UNITS, UNITS_SI)
        chip.write(MODE, MODES[self.params.mode])
        self.pause(MODE_CHANGE_S)

    def _reading(self, chip: Chip) -> CalibratedImu | None:
        """``None`` while it does not know yet how it is turned."""
        data = chip.read(ACCELERATION, _MAX_READ)
        calibration, mode = chip.read(CALIBRATION, 1)[0], chip.read(MODE, 1)[0] & 0x0F
        if mode != MODES[self.params.mode]:
            raise DeviceGone(f"{self.params.source}: the BNO055 has lost its settings", "look at its power")
        w, x, y, z = (part / _LSB_PER_UNIT for part in struct.unpack_from("<4h", data, _QUATERNION))
        length = math.hypot(w, x, y, z)
        if not 0.9 < length < 1.1:
            self.count_loss("refused")
            return None
        orientation = Quaternion(w=w / length, x=x / length, y=y / length, z=z / length)
        rates = self._mounting.turned(_scaled(data, _GYROSCOPE, _LSB_PER_RADPS))
        accelerations = self._mounting.turned(_scaled(data, 0, _LSB_PER_MPS2))
        return CalibratedImu(
            angular_velocity=AngularVelocity(**dict(zip("xyz", rates, strict=True))),
            linear_acceleration=LinearAcceleration(**dict(zip("xyz", accelerations, strict=True))),
            orientation=self._mounting.orientation(orientation),
            frame_id=self.params.frame_id,
            timestamp=wall_time_us(),
            calibration_system=calibration >> 6,
            calibration_gyroscope=calibration >> 4 & 3,
            calibration_accelerometer=calibration >> 2 & 3,
            calibration_magnetometer=calibration & 3,
        )


def _scaled(data: bytes, at: int, per_unit: float) -> tuple[float, float, float]:
    x, y, z = (one / per_unit for one in struct.unpack_from("<3h", data, at))
    return x, y, z


class Bno055Configurer(DataChannelConfigurer[Bno055Params]):
    """Orientation, rotation and acceleration of a Bosch BNO055 on I²C."""

    connector_type = "imu-bno055"
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake"}

    def configure(self) -> Bno055:
        return Bno055(self.label, self.params)
