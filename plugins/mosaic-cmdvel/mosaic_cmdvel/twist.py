"""A velocity in SI units, frame ``base_link`` as in REP-103: x forward, y left, z up. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mosaic_core import messages


@dataclass(frozen=True, slots=True)
class Twist:
    """Linear velocity in m/s and angular velocity in rad/s; positive ``angular_z_radps`` turns left."""

    linear_x_mps: float = 0.0
    linear_y_mps: float = 0.0
    linear_z_mps: float = 0.0
    angular_x_radps: float = 0.0
    angular_y_radps: float = 0.0
    angular_z_radps: float = 0.0

    @property
    def linear_mps(self) -> float:
        """Length of the linear part."""
        return math.hypot(self.linear_x_mps, self.linear_y_mps, self.linear_z_mps)

    @property
    def angular_radps(self) -> float:
        """Length of the angular part."""
        return math.hypot(self.angular_x_radps, self.angular_y_radps, self.angular_z_radps)

    @property
    def is_zero(self) -> bool:
        return self == STANDSTILL


STANDSTILL = Twist()


def velocity_of(message: messages.Twist) -> Twist:
    """What an operator sent."""
    linear, angular = message.linear, message.angular
    return Twist(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)


def limited(twist: Twist, *, max_linear_mps: float, max_angular_radps: float) -> Twist:
    """``twist`` with both parts no longer than their maximum.

    Each part is scaled as a vector, so that its direction stays: pushing a holonomic base diagonally does not bend
    its path. The two parts are scaled independently: a robot that is asked to drive too fast still turns as asked.
    """
    x_mps, y_mps, z_mps = _shortened(twist.linear_x_mps, twist.linear_y_mps, twist.linear_z_mps, max_linear_mps)
    roll, pitch, yaw = _shortened(
        twist.angular_x_radps, twist.angular_y_radps, twist.angular_z_radps, max_angular_radps
    )
    return Twist(x_mps, y_mps, z_mps, roll, pitch, yaw)


def _shortened(x: float, y: float, z: float, maximum: float) -> tuple[float, float, float]:
    if math.hypot(x, y, z) <= maximum:
        return x, y, z
    largest = max(abs(x), abs(y), abs(z))
    x, y, z = x / largest, y / largest, z / largest  # so that the length below can't overflow
    shortening = maximum / math.hypot(x, y, z)
    return x * shortening, y * shortening, z * shortening
