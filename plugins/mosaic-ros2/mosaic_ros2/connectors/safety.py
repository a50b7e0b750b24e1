"""Models the limits of what is published: speeds of a base beside those that every receiver has."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.limits import FieldLimit

LINEAR = ("linear.x", "linear.y", "linear.z")
ANGULAR = ("angular.x", "angular.y", "angular.z")
BASE_TIMEOUT_S = 0.5
"""As ROS' diff_drive_controller and twist_mux have it."""


def _rate(unit: str, what: str) -> Any:
    return Field(default=None, gt=0, le=1000, description=f"Fastest {what} of a Twist, in {unit}; none: as commanded.")


class PublisherSafety(SafetyConfig):
    """Limits of published commands. Those of a Twist must be said: a base without limits drives as fast as it is
    told."""

    max_linear_mps: float | None = Field(default=None, gt=0, le=100, description="Longest linear velocity, in m/s.")
    max_angular_radps: float | None = Field(
        default=None, gt=0, le=100, description="Longest angular velocity, in rad/s."
    )
    max_linear_accel_mps2: float | None = _rate("m/s²", "gain of linear velocity")
    max_linear_decel_mps2: float | None = _rate("m/s²", "loss of linear velocity")
    max_angular_accel_radps2: float | None = _rate("rad/s²", "gain of angular velocity")
    max_angular_decel_radps2: float | None = _rate("rad/s²", "loss of angular velocity")

    def names_speeds(self) -> bool:
        """Whether it says how fast a base may go and turn."""
        return self.max_linear_mps is not None and self.max_angular_radps is not None

    def field_limits(self) -> tuple[FieldLimit, ...]:
        """Both parts as vectors: a base that is told to go too fast keeps its direction."""
        found = []
        if self.max_linear_mps is not None:
            rise, fall = self.max_linear_accel_mps2, self.max_linear_decel_mps2
            found.append(FieldLimit(LINEAR, max_norm=self.max_linear_mps, max_rise_per_s=rise, max_fall_per_s=fall))
        if self.max_angular_radps is not None:
            rise, fall = self.max_angular_accel_radps2, self.max_angular_decel_radps2
            found.append(FieldLimit(ANGULAR, max_norm=self.max_angular_radps, max_rise_per_s=rise, max_fall_per_s=fall))
        return tuple(found)


class OriginalTwistSafety(PublisherSafety):
    """The limits of original robots' velocity receivers, which have none in their files."""

    timeout_s: float = Field(
        default=BASE_TIMEOUT_S, gt=0, le=5, description="Silence after which the base stands still."
    )
    max_linear_mps: float | None = Field(default=1.0, gt=0, le=100, description="Longest linear velocity, in m/s.")
    max_angular_radps: float | None = Field(
        default=1.5, gt=0, le=100, description="Longest angular velocity, in rad/s."
    )
