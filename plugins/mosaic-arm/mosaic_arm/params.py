"""The params of an arm: its bus, its joints and their limits. Every connector of one arm takes the same."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mosaic_arm.calibration import MotorCalibration, check_motors, read_calibration
from mosaic_arm.joint_scale import UNCALIBRATED, JointScale
from mosaic_core import Params
from mosaic_core.contract.params import unit
from mosaic_core.words.errors import hint_at

BusType = Literal["feetech", "dynamixel", "fake"]
ExitPolicy = Literal["hold", "release"]
JointName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_/ -]{0,63}$")]


class JointParams(Params):
    """One joint, its motor and its limits."""

    id: int = Field(ge=0, le=252, description="The number of its motor on the bus.")
    min_rad: float | None = Field(default=None, description="Least angle; none: the calibrated range.")
    max_rad: float | None = Field(default=None, description="Greatest angle; none: the calibrated range.")
    max_radps: float = Field(default=1.5, gt=0, le=50, description="Fastest that it is moved.")

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if self.min_rad is not None and self.max_rad is not None and self.min_rad >= self.max_rad:
            raise ValueError("min_rad must be less than max_rad")
        return self


SO101 = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
"""The joints of an SO-100 or SO-101, from the table up: motors 1 to 6."""


def _so101() -> dict[str, JointParams]:
    return {name: JointParams(id=number) for number, name in enumerate(SO101, 1)}


class ArmParams(Params):
    """An arm on a bus of serial servos."""

    bus: BusType = Field(default="feetech", description="`feetech`: STS and SMS; `dynamixel`: X series; `fake`: none.")
    port: str = Field(default="/dev/ttyACM0", min_length=1, description="The serial port; with `fake` any name.")
    baud: int = Field(default=1_000_000, ge=9600, le=4_000_000, description="Bits per second of the bus.")
    rate_hz: float = Field(default=100.0, gt=0, le=500, description="Turns of the bus: read all, write all.")
    calibration: str | None = Field(default=None, description="File as LeRobot writes it; none: ticks 0 to 4095.")
    joints: dict[JointName, JointParams] = Field(
        default_factory=_so101, min_length=1, max_length=64, description="By name; none: the six of an SO-101."
    )
    gripper: str | None = Field(default="gripper", description="Which joint the gripper is; none: there is none.")
    gripper_opening_m: float = Field(default=0.07, gt=0, le=1, description="Between the fingers when it is open.")
    gripper_force_n: float = Field(
        default=20.0, gt=0, le=1000, description="What it presses with all its torque.", json_schema_extra=unit("N")
    )
    torque_percent: float = Field(default=50.0, gt=0, le=100, description="Of each motor's torque, at most.")
    weight_kg: float = Field(default=0.6, gt=0, le=200, description="What falls when the motors let go.")
    starts_free: bool = Field(default=False, description="Motors stay off at first: an arm that a hand leads.")
    on_exit: ExitPolicy = Field(default="hold", description="When the robot ends: `release` lets the arm fall.")

    @model_validator(mode="after")
    def _names_fit(self) -> Self:
        check_motors(one.id for one in self.joints.values())
        if self.gripper is not None and self.gripper not in self.joints:
            hint = hint_at(self.gripper, self.joints)
            raise ValueError(f"gripper is no joint: '{self.gripper}'{hint} There are {', '.join(self.joints)}, or null")
        return self

    def calibrations(self) -> dict[str, MotorCalibration]:
        """Of each joint, read from the file if one is named. Raises :class:`~mosaic_core.MosaicError`."""
        ids = {name: one.id for name, one in self.joints.items()}
        if self.calibration is None:
            return {name: UNCALIBRATED.model_copy(update={"id": number}) for name, number in ids.items()}
        return read_calibration(Path(self.calibration), ids)


class PartParams(Params):
    """What each connector of an arm takes."""

    arm: ArmParams = Field(default_factory=ArmParams, description="The arm; the same for all its connectors.")


def joint_limits_rad(joint: JointParams, scale: JointScale) -> tuple[float, float]:
    """Least and greatest angle: the params' within the calibrated range. Raises :class:`ValueError` where nothing is
    left."""
    least, greatest = scale.limits_rad
    low = least if joint.min_rad is None else max(least, joint.min_rad)
    high = greatest if joint.max_rad is None else min(greatest, joint.max_rad)
    if low >= high:
        raise ValueError(f"min_rad and max_rad leave nothing of the calibrated range {least:.3f} to {greatest:.3f} rad")
    return low, high
