"""How a sensor sits on the robot: which of its axes looks where. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from mosaic_core.messages import Quaternion

Axis: TypeAlias = Literal["x", "y", "z", "-x", "-y", "-z"]
Axes: TypeAlias = tuple[Axis, Axis, Axis]
Triple: TypeAlias = tuple[float, float, float]
AS_THE_ROBOT: Axes = ("x", "y", "z")


def _row(axis: Axis) -> Triple:
    sign = -1.0 if axis.startswith("-") else 1.0
    x, y, z = (sign if axis.endswith(name) else 0.0 for name in "xyz")
    return x, y, z


@dataclass(frozen=True, slots=True)
class ImuMounting:
    """Turns what a sensor measures into the robot's frame: x ahead, y left, z up.

    ``axes``: the axis of the sensor that looks ahead, left, up. Raises :class:`ValueError` for three that are no
    rotation, such as a mirrored sensor.
    """

    axes: Axes = AS_THE_ROBOT

    def __post_init__(self) -> None:
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) != 1:
            raise ValueError("axes must be x, y and z, each once, as a right hand has them: [y, -x, z] for example")

    @property
    def _rows(self) -> tuple[Triple, Triple, Triple]:
        ahead, left, up = self.axes
        return _row(ahead), _row(left), _row(up)

    def turned(self, vector: Triple) -> Triple:
        """``vector`` of the sensor, in the robot's frame."""
        x, y, z = (sum(a * b for a, b in zip(row, vector, strict=True)) for row in self._rows)
        return x, y, z

    def orientation(self, sensor: Quaternion) -> Quaternion:
        """The robot's orientation, when that of its sensor is ``sensor``."""
        w, x, y, z = self._of_robot_in_sensor()
        return Quaternion(
            w=sensor.w * w - sensor.x * x - sensor.y * y - sensor.z * z,
            x=sensor.w * x + sensor.x * w + sensor.y * z - sensor.z * y,
            y=sensor.w * y - sensor.x * z + sensor.y * w + sensor.z * x,
            z=sensor.w * z + sensor.x * y - sensor.y * x + sensor.z * w,
        )

    def _of_robot_in_sensor(self) -> tuple[float, float, float, float]:
        """The rotation whose columns are the rows, as w, x, y, z: by the largest of the four, which is never 0."""
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        squares = {"w": 1 + a + e + i, "x": 1 + a - e - i, "y": 1 - a + e - i, "z": 1 - a - e + i}
        largest = max(squares, key=lambda name: squares[name])
        double = squares[largest] ** 0.5
        x, y, z = f - h, g - c, b - d
        parts = {
            "w": (double**2, x, y, z),
            "x": (x, double**2, b + d, c + g),
            "y": (y, b + d, double**2, f + h),
            "z": (z, c + g, f + h, double**2),
        }[largest]
        w, x, y, z = (part / (2 * double) for part in parts)
        return w, x, y, z
