"""Params that all connectors share, and names of the model, which are checked while the YAML file is read."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator
from pydantic.functional_validators import AfterValidator

from mosaic_core import Params, Shared
from mosaic_mujoco.world.facts import ModelFacts, NameKind
from mosaic_mujoco.world.live_simulation import LiveSimulation, shared_simulation
from mosaic_mujoco.world.model_file import facts_of_file


class MujocoParams(Params):
    """Params that everything of a simulated robot takes. ``model`` stands first: the names after it are its names."""

    model: str = Field(
        description="Path of the model (MJCF or URDF), or `arm` or `vehicle`, which come with this package. Connectors "
        "of one model share one simulation."
    )

    @field_validator("model")
    @classmethod
    def _can_be_read(cls, model: str) -> str:
        facts_of_file(model)
        return model

    @property
    def facts(self) -> ModelFacts:
        """What the model has; known since the params were checked."""
        return facts_of_file(self.model)

    def simulation(self, shared: Shared) -> LiveSimulation:
        """The robot's one simulation of this model."""
        return shared_simulation(shared, self.model)


class PeriodicParams(MujocoParams):
    period_s: float = Field(default=0.05, gt=0, le=60, description="Seconds between two messages.")


def _checked(kind: NameKind) -> Callable[[Any, ValidationInfo], Any]:
    def check(value: Any, info: ValidationInfo) -> Any:
        model = info.data.get("model")
        if model is not None:  # else its own mistake has been told
            names: Iterable[str] = () if value is None else (value,) if isinstance(value, str) else value
            for name in names:
                facts_of_file(model).check_name(kind, name)
        return value

    return check


def _named(kind: NameKind) -> Any:
    return AfterValidator(_checked(kind))


CameraName = Annotated[str, _named("camera")]
JointNames = Annotated[tuple[str, ...], _named("joint")]
JointName = Annotated[str, _named("joint")]
ActuatorName = Annotated[str, _named("actuator")]
ActuatorNames = Annotated[tuple[str, ...], _named("actuator")]
SensorName = Annotated[str, _named("sensor")]
BodyName = Annotated[str, _named("body")]
