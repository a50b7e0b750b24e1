"""`sim-pose`: where the simulated robot is and how it moves, in the world frame."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery, Message, unit
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.messages import AngularVelocity, Orientation, Position, Velocity, wall_time_us


class Twist(Message):
    """Velocity in the robot's own frame."""

    linear: Velocity
    angular: AngularVelocity


class Pose(Message):
    """MOSAIC's pose message, with the twist beside it."""

    position: Position
    orientation: Orientation
    twist: Twist
    timestamp: int = Field(description="Since 1970-01-01 UTC.", json_schema_extra=unit("µs"))


class SimPoseParams(SimParams):
    period_s: float = Field(default=0.05, gt=0, le=60, description="Seconds between two messages.")


class SimPose(DataChannelSendable[Pose]):
    delivery = Delivery.LATEST
    widget = "pose-trail"

    def __init__(self, label: str, params: SimPoseParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[Pose]:
        for _ in self.every(self._params.period_s):
            motion = self._world.state.motion
            yield Pose(
                position=Position(x=motion.x_m, y=motion.y_m),
                orientation=Orientation.of_yaw(motion.yaw_rad),
                twist=Twist(linear=Velocity(x=motion.linear_mps), angular=AngularVelocity(z=motion.angular_radps)),
                timestamp=wall_time_us(),
            )


class SimPoseConfigurer(DataChannelConfigurer[SimPoseParams]):
    """Odometry pose and velocity of the simulated robot."""

    connector_type = "sim-pose"

    def configure(self) -> SimPose:
        return SimPose(self.label, self.params, shared_world(self.shared, self.params.seed))
