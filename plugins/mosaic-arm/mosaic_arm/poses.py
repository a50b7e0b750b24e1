"""The ``arm-poses`` connector: go to a pose that has a name, save the present one. Which there are tells
``arm-pose-names``, to whoever looks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.joints import RESOURCE
from mosaic_arm.params import JointName, PartParams
from mosaic_arm.pose_file import ArmPose, PoseBook, PoseName
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import Message, Refused, Request, RequestHandler
from mosaic_core.contract.params import unit
from mosaic_core.words.errors import ConfigError, Problem, guess, hint_at

STEP_S = 0.02
ANSWER_S = 60.0
SETTLE_S = 2.0
"""For the last of the way, which a servo under load goes slowly."""
THERE_RAD = 0.1
"""Nearer than this the pose is reached: a small servo bends so much under its arm."""


class PoseParams(PartParams):
    poses: dict[PoseName, dict[JointName, float]] = Field(
        default={}, max_length=100, description="Angles by joint, by name; joints that are not named stay.",
        json_schema_extra=unit("rad"),
    )  # fmt: skip
    file: str | None = Field(default=None, description="Where poses are saved (JSON); none: nothing can be saved.")


class PoseQuestion(Message):
    """What to do with poses."""

    action: Literal["go", "save"] = "go"
    name: PoseName = Field(description="Of the pose.")
    speed_percent: float = Field(default=30.0, gt=0, le=100, description="Of each joint's fastest.")


class PoseProgress(Message):
    """How far the way is done."""

    done_percent: float


class PoseAnswer(Message):
    """The poses there are; for `go` how far from the pose the farthest joint came to stand."""

    names: list[str]
    off_by_rad: float | None = None


class ArmPoses(RequestHandler[PoseQuestion, PoseAnswer]):
    """Goes to poses within the arm's limits, all joints arriving together. A stop, the loss of the lease, taking the
    request back, or any other command to one of its joints ends the way where it is."""

    requires_lease = True
    resource = RESOURCE
    at_once: ClassVar[int] = 2
    answer_within_s: ClassVar[float] = ANSWER_S

    def __init__(self, label: str, arm: KeptArm, book: PoseBook) -> None:
        super().__init__(label)
        self._arm = arm
        self._book = book

    def answer(self, question: PoseQuestion, request: Request) -> PoseAnswer:
        off_by_rad = None
        if question.action == "save":
            self._save(question.name)
        else:
            off_by_rad = self._go(question.name, question.speed_percent / 100, request)
        return PoseAnswer(names=self._book.names(), off_by_rad=off_by_rad)

    def _save(self, name: str) -> None:
        angles_rad = self._arm.present().angles_rad
        self._book.save(name, {joint: round(angle, 5) for joint, angle in angles_rad.items()})

    def _go(self, name: str, speed_share: float, request: Request) -> float:
        pose = self._book.pose(name)
        if pose is None:
            names = self._book.names()
            known = f"{hint_at(name, names)} There are: {', '.join(names) or 'none'}"
            raise Refused("arm.unknown_pose", f"no pose is called '{name}'{known}")
        start = {joint: self._standing(joint) for joint in pose}
        goal = {joint: self._arm.joints[joint].within(angle) for joint, angle in pose.items()}
        times = [abs(goal[one] - start[one]) / (self._arm.joints[one].max_radps * speed_share) for one in goal]
        whole_s = max(times, default=0.0)
        if whole_s + SETTLE_S > ANSWER_S:
            raise Refused("arm.too_slow", f"the way would take {whole_s:.0f} s")
        self._move(start, goal, whole_s, request)
        return self._settled(goal, request)

    def _standing(self, joint: str) -> float:
        angle = self._arm.standing_rad(joint)
        if angle is None:
            raise Refused("plugin.no_device", self._arm.gone.message)
        return angle

    def _move(self, start: ArmPose, goal: ArmPose, whole_s: float, request: Request) -> None:
        """Along the straight line between two poses, in the time that its slowest joint needs."""
        token, began_s = object(), self.monotonic_s()
        for share in self._shares(began_s, whole_s):
            self._arm.aim({one: start[one] + (goal[one] - start[one]) * share for one in goal}, token)
            request.progress(PoseProgress(done_percent=round(100 * share, 1)))
            if request.pause(STEP_S):
                self._arm.hold()
                raise Refused("request.cancelled")
            if not self._arm.is_led_by(token, goal):  # a stop, or somebody's command
                raise Refused("arm.overtaken")

    def _shares(self, began_s: float, whole_s: float) -> Iterator[float]:
        """How much of the way shall be done by the next step; the last is 1."""
        share = 0.0
        while share < 1.0:
            share = min(1.0, (self.monotonic_s() - began_s + STEP_S) / whole_s) if whole_s else 1.0
            yield share

    def _settled(self, goal: ArmPose, request: Request) -> float:
        ends_at_s = self.monotonic_s() + SETTLE_S
        while True:
            present = self._arm.present().angles_rad
            off_by_rad = max((abs(present[one] - angle) for one, angle in goal.items()), default=0.0)
            if off_by_rad <= THERE_RAD:
                return round(off_by_rad, 4)
            if self.monotonic_s() >= ends_at_s:
                raise Refused("arm.not_there", f"the farthest joint is off by {off_by_rad:.2f} rad")
            if request.pause(STEP_S):
                self._arm.hold()
                raise Refused("request.cancelled")


class ArmPosesConfigurer(ArmConfigurer[PoseParams]):
    """Moves an arm to poses that have names, and saves where it is."""

    connector_type = "arm-poses"
    example: ClassVar[dict[str, Any] | None] = {
        "arm": {"port": "/dev/ttyACM0"}, "poses": {"rest": {"shoulder_lift": -1.5, "elbow_flex": 1.5}},
    }  # fmt: skip

    def configure(self) -> ArmPoses:
        arm = self.arm
        book = PoseBook(self.params.poses, Path(self.params.file) if self.params.file else None)
        strange = [*_strange_joints(book, list(arm.joints))]
        if strange:
            raise ConfigError(strange)
        arm.pose_books[self.label] = book
        return ArmPoses(self.label, arm, book)


def _strange_joints(book: PoseBook, joints: list[str]) -> Iterator[Problem]:
    """Joints of poses that the arm does not have, each at its place in the YAML file or with the file that has it."""
    for name in book.names():
        for joint in sorted(set(book.pose(name) or ()) - set(joints)):
            file = book.file_of(name)
            path = "file" if file else f"poses.{name}.{joint}"
            where = f"{file}: " if file else ""
            message = f"{where}the pose '{name}' names the joint '{joint}', which this arm does not have"
            yield Problem(message, path=path, cure=guess(joint, joints, f"it has: {', '.join(joints)}"))
