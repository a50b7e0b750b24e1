"""One joint of an arm as the thread of its bus knows it, and what the arm was like at one moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mosaic_arm.calibration import MotorCalibration
from mosaic_arm.joint_scale import JointScale
from mosaic_arm.params import ArmParams, joint_limits_rad
from mosaic_arm.servos.bus import MotorReading
from mosaic_core.words.errors import MosaicError


@dataclass(frozen=True, slots=True)
class ArmJoint:
    """A joint with its motor, its scale and its limits."""

    name: str
    motor: int
    scale: JointScale
    low_rad: float
    high_rad: float
    max_radps: float

    def within(self, angle_rad: float) -> float:
        """The nearest angle that it may have."""
        return min(max(angle_rad, self.low_rad), self.high_rad)


@dataclass(frozen=True, slots=True)
class ArmSnapshot:
    """Where an arm was at ``at_s`` of the monotonic clock; ``stamp_us`` is the same moment of the wall clock."""

    at_s: float
    stamp_us: int
    angles_rad: Mapping[str, float]
    speeds_radps: Mapping[str, float]
    motors: Mapping[str, MotorReading]


def joints_of(params: ArmParams, calibrations: Mapping[str, MotorCalibration]) -> tuple[ArmJoint, ...]:
    """All joints, in the order of the params. Raises :class:`MosaicError` where no angle is left."""
    return tuple(_joint(name, params, calibrations[name]) for name in params.joints)


def _joint(name: str, params: ArmParams, calibration: MotorCalibration) -> ArmJoint:
    scale, its = JointScale.of(calibration), params.joints[name]
    try:
        low, high = joint_limits_rad(its, scale)
    except ValueError as error:
        raise MosaicError(f"joint '{name}': {error}", code="config.invalid", cure="Widen the limits.") from None
    return ArmJoint(name, its.id, scale, low, high, its.max_radps)
