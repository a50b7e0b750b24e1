"""`sim-imu`: rotation rates, accelerations and attitude of the simulated robot, with seeded noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import AngularVelocity, Imu, LinearAcceleration, Quaternion, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.motion import Motion

GRAVITY_MPS2 = 9.80665


class SimImuParams(SimParams):
    period_s: float = Field(default=0.05, gt=0, le=60, description="Seconds between two messages.")
    gyro_noise_radps: float = Field(default=0.004, ge=0, description="Standard deviation of the rotation rates.")
    acceleration_noise_mps2: float = Field(default=0.03, ge=0, description="Standard deviation of the accelerations.")


class SimImu(DataChannelSendable[Imu]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimImuParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[Imu]:
        noise = self._world.world.noise(self.label)
        for _ in self.every(self._params.period_s):
            yield self._measured(self._world.state.motion, noise)

    def _measured(self, motion: Motion, noise: np.random.Generator) -> Imu:
        gyro = noise.normal(0.0, self._params.gyro_noise_radps, 3)
        shake = noise.normal(0.0, self._params.acceleration_noise_mps2, 3)
        centripetal_mps2 = motion.linear_mps * motion.angular_radps
        return Imu(
            angular_velocity=AngularVelocity(x=gyro[0], y=gyro[1], z=motion.angular_radps + gyro[2]),
            linear_acceleration=LinearAcceleration(
                x=motion.linear_mps2 + shake[0], y=centripetal_mps2 + shake[1], z=GRAVITY_MPS2 + shake[2]
            ),
            orientation=Quaternion.of_yaw(motion.yaw_rad),
            timestamp=wall_time_us(),
        )


class SimImuConfigurer(DataChannelConfigurer[SimImuParams]):
    """IMU of the simulated robot: rotation rates, accelerations, attitude."""

    connector_type = "sim-imu"

    def configure(self) -> SimImu:
        return SimImu(self.label, self.params, shared_world(self.shared, self.params.seed))
