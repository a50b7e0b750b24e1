"""Positions and velocities. Axes as in REP-103: x forward, y left, z up; angles count counter-clockwise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from mosaic_core.contract.params import Message, unit
from mosaic_core.words.limits import MotionKind

MetresPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("m/s"))]
RadiansPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("rad/s"))]


class _Components(Message):
    """Three numbers of which some may be absent. One that has none of them, but other keys, is misspelt."""

    @model_validator(mode="before")
    @classmethod
    def _has_a_component(cls, data: Any) -> Any:
        if isinstance(data, dict) and data and not data.keys() & {"x", "y", "z"}:
            raise ValueError(f"needs x, y or z, has only {_names(data)}")
        return data


class LinearVelocity(_Components):
    """Metres per second: x forward, y left, z up."""

    x: MetresPerSecond = 0.0
    y: MetresPerSecond = 0.0
    z: MetresPerSecond = 0.0


class AngularVelocity(_Components):
    """Radians per second; positive z turns left."""

    x: RadiansPerSecond = 0.0
    y: RadiansPerSecond = 0.0
    z: RadiansPerSecond = 0.0


class Twist(Message):
    """A velocity in the frame of what moves (``base_link``): ``{"linear": {"x", "y", "z"}, "angular": {…}}``.

    Absent components are 0, but one of the two must be there: what is no velocity at all (``{}``, a misspelt key, a
    string, NaN) is refused instead of being taken for a stop.
    """

    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {
        f"{part}.{axis}": "velocity" for part in ("linear", "angular") for axis in ("x", "y", "z")
    }
    linear: LinearVelocity = LinearVelocity()
    angular: AngularVelocity = AngularVelocity()

    @model_validator(mode="before")
    @classmethod
    def _is_a_twist(cls, data: Any) -> Any:
        if isinstance(data, dict) and not data.keys() & {"linear", "angular"}:
            raise ValueError(f"a Twist needs linear or angular, has {_names(data) if data else 'neither'}")
        return data


def _names(data: dict[Any, Any]) -> str:
    """The first keys, short enough for an error message that travels back to the sender."""
    return ", ".join(str(key)[:20] for key in list(data)[:4])
