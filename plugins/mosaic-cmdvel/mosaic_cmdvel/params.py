"""Models the params of a ``cmd-vel`` connector: which drive with which params, and its limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, SerializeAsAny, ValidationError, WrapValidator, field_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError

from mosaic_cmdvel.drive import DriveParams
from mosaic_cmdvel.drive_registry import DriveNotFound, installed_drives, load_drive
from mosaic_core.contract.params import Params
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.limits import FieldLimit
from mosaic_core.words.safety_config import SafePolicy


def _params_of_its_drive(value: Any, _handler: Any) -> DriveParams:
    """``value`` as the params model of the drive that its ``type`` names; errors point at the wrong field."""
    if isinstance(value, DriveParams):
        return value
    if not isinstance(value, Mapping) or not isinstance(value.get("type"), str):
        names = ", ".join(sorted({entry.name for entry in installed_drives()}))
        raise _error(f"a drive needs a type, for example {{type: log}}; installed: {names}", value)
    try:
        drive = load_drive(value["type"])
    except DriveNotFound as error:
        raise _error(str(error), value, "type") from error
    return drive.params_model.model_validate(dict(value))


def _error(reason: str, value: Any, *place: str) -> ValidationError:
    custom = PydanticCustomError("drive", "{reason}", {"reason": reason})
    return ValidationError.from_exception_data("drive", [InitErrorDetails(type=custom, loc=place, input=value)])


class _SchemaOfAllDrives:
    """Describes a drive in JSON Schema as any one of those installed, so that editors complete its params."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        choices = []
        for entry in installed_drives():
            try:
                model = load_drive(entry.name).params_model
            except DriveNotFound:
                continue  # a broken drive that nobody uses breaks nothing
            choice = handler.resolve_ref_schema(handler(model.__pydantic_core_schema__))
            properties = {**choice.get("properties", {}), "type": {"const": entry.name, "type": "string"}}
            required = sorted({"type", *choice.get("required", [])})
            choices.append({**choice, "title": entry.name, "properties": properties, "required": required})
        return {"anyOf": choices} if choices else handler(schema)


AnyDriveParams = Annotated[SerializeAsAny[DriveParams], WrapValidator(_params_of_its_drive), _SchemaOfAllDrives]


class CmdVelParams(Params):
    drive: AnyDriveParams = Field(description="What moves: a drive's type and its own params.")


LINEAR = ("linear.x", "linear.y", "linear.z")
ANGULAR = ("angular.x", "angular.y", "angular.z")


def _rate(unit: str, what: str) -> Any:
    return Field(default=None, gt=0, le=1000, description=f"Fastest {what}, in {unit}; none: as commanded.")


class CmdVelSafety(SafetyConfig):
    """The limits of a base. There is no way to switch the time-out off."""

    timeout_s: float = Field(default=0.3, gt=0, le=5, description="Silence after which the base stands still.")
    max_linear_mps: float = Field(default=1.0, gt=0, le=100, description="Longest linear velocity, in m/s.")
    max_angular_radps: float = Field(default=1.5, gt=0, le=100, description="Longest angular velocity, in rad/s.")
    max_linear_accel_mps2: float | None = _rate("m/s²", "gain of linear velocity")
    max_linear_decel_mps2: float | None = _rate("m/s²", "loss of linear velocity on command (a stop is always at once)")
    max_angular_accel_radps2: float | None = _rate("rad/s²", "gain of angular velocity")
    max_angular_decel_radps2: float | None = _rate("rad/s²", "loss of angular velocity on command")
    requires_lease: bool = Field(default=True, description="Take commands only from the lease's holder.")

    @field_validator("on_timeout", "on_loss")
    @classmethod
    def _stands_in_the_end(cls, policy: SafePolicy | None) -> SafePolicy | None:
        if policy == "hold":
            raise ValueError("a base that holds its velocity drives on for ever; use callback (it stops) or zero")
        return policy

    def field_limits(self) -> tuple[FieldLimit, ...]:
        """Both parts as vectors: a base that is told to go too fast keeps its direction."""
        return (
            FieldLimit(
                LINEAR,
                max_norm=self.max_linear_mps,
                max_rise_per_s=self.max_linear_accel_mps2,
                max_fall_per_s=self.max_linear_decel_mps2,
            ),
            FieldLimit(
                ANGULAR,
                max_norm=self.max_angular_radps,
                max_rise_per_s=self.max_angular_accel_radps2,
                max_fall_per_s=self.max_angular_decel_radps2,
            ),
        )
