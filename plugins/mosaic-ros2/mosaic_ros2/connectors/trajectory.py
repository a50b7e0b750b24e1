"""Publishes where joints shall go, as a ``trajectory_msgs/JointTrajectory`` of one point.

With ``joints`` a command has a number for each joint by its name, so that ``safety.limits`` hold for each; without, it
is a standard ``JointTarget``.
"""

from __future__ import annotations

import types
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from pydantic import Field, create_model

from mosaic_core.contract.params import Message, unit
from mosaic_core.messages import JointTarget
from mosaic_core.words.data_type import Delivery
from mosaic_ros2.bus.kept_publication import KeptPublication
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.joint_watch import JointWatch
from mosaic_ros2.connectors.publishing import RosPublisher
from mosaic_ros2.conversion.joints import trajectory

T = TypeVar("T")

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
HOLD_S = 0.2
"""Time to come to rest where the joints are."""


class TrajectoryPublisher(RosPublisher[T], Generic[T]):
    """Sends joints where they shall go, and holds them where they are when nobody commands."""

    requires_lease = True
    timeout_s = 0.5
    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(
        self, label: str, publication: KeptPublication, encoder: CdrEncoder, watch: JointWatch, reach_s: float
    ) -> None:
        """``reach_s``: the time for a way of which the command does not say how long it may take."""
        super().__init__(label, publication, encoder)
        self._watch = watch
        self._reach_s = reach_s
        self._moved: tuple[str, ...] = ()

    def target(self, data: T) -> JointTarget:
        """The command as a target."""
        return data  # type: ignore[return-value]

    def fields(self, data: T) -> Mapping[str, Any]:
        target = self.target(data)
        self._moved = tuple(dict.fromkeys((*self._moved, *target.names)))
        return trajectory(target, self._reach_s)

    def safe_fields(self) -> Mapping[str, Any]:
        """Every joint that was moved stays where it is. Where that is not known, a trajectory without points: it ends
        the one that runs, and ros2_control's controller holds the position."""
        known = self._watch.positions()
        held = {name: known[name] for name in self._moved if name in known}
        if len(held) < len(self._moved) or not held:
            return {"joint_names": list(self._moved), "points": []}
        return trajectory(JointTarget(names=list(held), positions=list(held.values())), HOLD_S)

    def reported_position(self, field: str) -> float | None:
        return self._watch.positions().get(field)


class NamedJointsPublisher(TrajectoryPublisher[T], Generic[T]):
    """The same for commands that have a number for each joint."""

    def target(self, data: T) -> JointTarget:
        wishes = data.model_dump(exclude_none=True)  # type: ignore[attr-defined]
        return JointTarget(names=list(wishes), positions=list(wishes.values()))


def trajectory_publisher(joints: Sequence[str]) -> type[TrajectoryPublisher[Any]]:
    """A handler class: with these joints, or for standard targets where none are named."""
    if not joints:
        return _Targets
    position = Annotated[float, Field(strict=True, json_schema_extra=unit("rad"))]
    fields: Any = dict.fromkeys(joints, (position | None, None))
    message = create_model(
        "NamedJoints", __base__=Message, __doc__="Where each joint shall go; absent: it stays.", **fields
    )
    content: dict[str, Any] = {"__module__": __name__, "position_fields": tuple(joints)}
    base: Any = NamedJointsPublisher
    return types.new_class("NamedJointsOf", (base[message],), {}, lambda own: own.update(content))


class _Targets(TrajectoryPublisher[JointTarget]):
    pass
