"""`sim-pose`: where the simulated robot is and how it moves, in the world frame."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import Odometry, Point, Quaternion, Twist, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world


class SimPoseParams(SimParams):
    period_s: float = Field(default=0.05, gt=0, le=60, description="Seconds between two messages.")


class SimPose(DataChannelSendable[Odometry]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimPoseParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[Odometry]:
        for _ in self.every(self._params.period_s):
            motion = self._world.state.motion
            yield Odometry(
                position=Point(x=motion.x_m, y=motion.y_m),
                orientation=Quaternion.of_yaw(motion.yaw_rad),
                twist=Twist.planar(motion.linear_mps, yaw_radps=motion.angular_radps),
                timestamp=wall_time_us(),
            )


class SimPoseConfigurer(DataChannelConfigurer[SimPoseParams]):
    """Odometry pose and velocity of the simulated robot."""

    connector_type = "sim-pose"

    def configure(self) -> SimPose:
        return SimPose(self.label, self.params, shared_world(self.shared, self.params.seed))
