"""Converts a velocity into wheel speeds and back, for a base with two driven wheels. Pure.

Differential drive (Siegwart, Nourbakhsh: Introduction to Autonomous Mobile Robots, ch. 3):
``v = r (right + left) / 2``, ``w = r (right - left) / track``.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.messages import Twist


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """The speeds of both wheels in rad/s; positive rolls forward."""

    left_radps: float
    right_radps: float


@dataclass(frozen=True, slots=True)
class DifferentialBase:
    """Two wheels on one axle; ``track_width_m`` is the distance between their contact points."""

    wheel_radius_m: float
    track_width_m: float

    def wheels(self, twist: Twist) -> WheelSpeeds:
        """The speeds that roll along ``twist``; only its x and yaw, the base can do nothing else."""
        turning_mps = twist.angular.z * self.track_width_m / 2
        return WheelSpeeds(
            left_radps=(twist.linear.x - turning_mps) / self.wheel_radius_m,
            right_radps=(twist.linear.x + turning_mps) / self.wheel_radius_m,
        )

    def twist(self, wheels: WheelSpeeds) -> Twist:
        """The velocity that these wheel speeds make."""
        left_mps = wheels.left_radps * self.wheel_radius_m
        right_mps = wheels.right_radps * self.wheel_radius_m
        turning_mps = right_mps - left_mps
        return Twist.planar((right_mps + left_mps) / 2, yaw_radps=turning_mps / self.track_width_m)


def saturated(wheels: WheelSpeeds, max_wheel_radps: float) -> WheelSpeeds:
    """Both wheels scaled alike until neither is faster than the maximum: slower, on the same curve."""
    fastest_radps = max(abs(wheels.left_radps), abs(wheels.right_radps))
    if fastest_radps <= max_wheel_radps:
        return wheels
    return WheelSpeeds(
        left_radps=wheels.left_radps / fastest_radps * max_wheel_radps,
        right_radps=wheels.right_radps / fastest_radps * max_wheel_radps,
    )
