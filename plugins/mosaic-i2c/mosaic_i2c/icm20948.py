"""The ``imu-icm20948`` connector: rotation and acceleration of a TDK ICM-20948.

Registers and scales are those of TDK's data sheet DS-000189, sections 7 to 10. Its compass is not read:
whoever wants an orientation takes a sensor that computes one.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.messages import AngularVelocity, Imu, LinearAcceleration, wall_time_us
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import DeviceGone
from mosaic_i2c.bus import Chip, opened
from mosaic_i2c.fake_chips import FakeIcm20948
from mosaic_i2c.mounting import ImuMounting
from mosaic_i2c.params import ImuParams

BANK = 0x7F
WHO_AM_I, WHO_AM_I_IS = 0x00, 0xEA
POWER, ACCELERATION = 0x06, 0x2D
RESET, AWAKE = 0x80, 0x01
"""AWAKE: with the best clock that it finds."""
ASLEEP = 0x40
GYROSCOPE_CONFIG, ACCELERATION_CONFIG = 0x01, 0x14
_FILTERED = 0x19
"""Low-pass of about 50 Hz (DLPFCFG 3, FCHOICE 1): the wheels' hum is no rotation."""
RESET_S, WAKE_S = 0.1, 0.05
STANDARD_GRAVITY_MPS2 = 9.80665
GYROSCOPE_RANGES = {250: (0, 131.0), 500: (1, 65.5), 1000: (2, 32.8), 2000: (3, 16.4)}
"""°/s: setting, steps per °/s."""
ACCELERATION_RANGES = {2: (0, 16384), 4: (1, 8192), 8: (2, 4096), 16: (3, 2048)}
"""g: setting, steps per g."""


class Icm20948Params(ImuParams):
    address: int = Field(default=0x69, ge=0x68, le=0x69, description="0x69, or 0x68 with AD0 low.")
    gyroscope_range_dps: Literal[250, 500, 1000, 2000] = Field(default=500, description="Fastest rotation, in °/s.")
    acceleration_range_g: Literal[2, 4, 8, 16] = Field(default=4, description="Greatest acceleration, in g.")


class Icm20948(DataChannelSendable[Imu]):
    """Sends what the sensor measures."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: Icm20948Params) -> None:
        super().__init__(label)
        self.params = params
        self._mounting = ImuMounting(params.axes)

    def messages(self) -> Iterator[Imu]:
        with opened(self.params.source, self.params.address, FakeIcm20948) as chip:
            self._set_up(chip)
            for _ in self.every(1 / self.params.rate_hz):
                yield self._reading(chip)

    def _set_up(self, chip: Chip) -> None:
        chip.write(BANK, 0x00)
        (found,) = chip.read(WHO_AM_I, 1)
        if found != WHO_AM_I_IS:
            where = f"{self.params.source}: the chip at {self.params.address:#04x}"
            raise DeviceGone(f"{where} is no ICM-20948, its id is {found:#04x}", "look at the address")
        chip.write(POWER, RESET)
        self.pause(RESET_S)
        chip.write(POWER, AWAKE)
        self.pause(WAKE_S)
        chip.write(BANK, 0x20)
        chip.write(GYROSCOPE_CONFIG, _FILTERED | GYROSCOPE_RANGES[self.params.gyroscope_range_dps][0] << 1)
        chip.write(ACCELERATION_CONFIG, _FILTERED | ACCELERATION_RANGES[self.params.acceleration_range_g][0] << 1)
        chip.write(BANK, 0x00)

    def _reading(self, chip: Chip) -> Imu:
        if chip.read(POWER, 1)[0] & ASLEEP:
            raise DeviceGone(f"{self.params.source}: the ICM-20948 has lost its settings", "look at its power")
        *accelerations, x, y, z = struct.unpack(">6h", chip.read(ACCELERATION, 12))
        per_dps, per_g = (
            GYROSCOPE_RANGES[self.params.gyroscope_range_dps][1],
            ACCELERATION_RANGES[self.params.acceleration_range_g][1],
        )
        rates = self._mounting.turned((math.radians(x / per_dps), math.radians(y / per_dps), math.radians(z / per_dps)))
        ax, ay, az = (one / per_g * STANDARD_GRAVITY_MPS2 for one in accelerations)
        felt = self._mounting.turned((ax, ay, az))
        return Imu(
            angular_velocity=AngularVelocity(**dict(zip("xyz", rates, strict=True))),
            linear_acceleration=LinearAcceleration(**dict(zip("xyz", felt, strict=True))),
            frame_id=self.params.frame_id,
            timestamp=wall_time_us(),
        )


class Icm20948Configurer(DataChannelConfigurer[Icm20948Params]):
    """Rotation and acceleration of a TDK ICM-20948 on I²C."""

    connector_type = "imu-icm20948"
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake"}

    def configure(self) -> Icm20948:
        return Icm20948(self.label, self.params)
