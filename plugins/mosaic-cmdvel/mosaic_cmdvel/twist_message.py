"""The message of a ``cmd-vel`` channel: the Twist JSON of the original dashboards, read strictly.

Absent components are 0, as the original documents them. But what is no velocity at all (``{}``, a misspelt key, a
string, NaN) is refused instead of being taken for a stop: whoever sends it shall hear of it.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator

from mosaic_cmdvel.twist import Twist
from mosaic_core.contract.params import Message, unit

MetresPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("m/s"))]
RadiansPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("rad/s"))]


class _Vector(Message):
    @model_validator(mode="before")
    @classmethod
    def _has_a_component(cls, data: Any) -> Any:
        if isinstance(data, dict) and data and not data.keys() & {"x", "y", "z"}:
            raise ValueError(f"needs x, y or z, has only {_names(data)}")
        return data


class LinearVelocity(_Vector):
    """Metres per second: x forward, y left, z up."""

    x: MetresPerSecond = 0.0
    y: MetresPerSecond = 0.0
    z: MetresPerSecond = 0.0


class AngularVelocity(_Vector):
    """Radians per second; positive z turns left."""

    x: RadiansPerSecond = 0.0
    y: RadiansPerSecond = 0.0
    z: RadiansPerSecond = 0.0


class TwistMessage(Message):
    """``{"linear": {"x", "y", "z"}, "angular": {"x", "y", "z"}}``; at least one of the two."""

    linear: LinearVelocity = LinearVelocity()
    angular: AngularVelocity = AngularVelocity()

    @model_validator(mode="before")
    @classmethod
    def _is_a_twist(cls, data: Any) -> Any:
        if isinstance(data, dict) and not data.keys() & {"linear", "angular"}:
            raise ValueError(f"a Twist needs linear or angular, has {_names(data) if data else 'neither'}")
        return data

    def twist(self) -> Twist:
        return Twist(
            linear_x_mps=self.linear.x,
            linear_y_mps=self.linear.y,
            linear_z_mps=self.linear.z,
            angular_x_radps=self.angular.x,
            angular_y_radps=self.angular.y,
            angular_z_radps=self.angular.z,
        )


def _names(data: dict[Any, Any]) -> str:
    """The first keys, short enough for an error message that travels back to the sender."""
    return ", ".join(str(key)[:20] for key in list(data)[:4])
