"""Models ``safety:`` of a connector and ``control:`` of a robot in the YAML file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from mosaic_core.words.control import ResourceName
from mosaic_core.words.limits import Curve, FieldLimit, MotionKind, PictureRule, SlowDownCurves
from mosaic_core.words.wire_model import ConfigModel

SafePolicy = Literal["callback", "zero", "hold"]
FIELD_PATH = r"^[A-Za-z_][A-Za-z0-9_-]*(\.([^.*]+|\*))*$"
"""Joints of large arms are called ``left arm/shoulder``; a star stands for every number of a list."""
FieldPath = Annotated[str, Field(pattern=FIELD_PATH)]
CurveInFile = Annotated[
    Curve | Literal["off"], Field(description="Points [value, factor]: values rise, factors fall from 1; or `off`.")
]
MAX_TIMEOUT_S = 60.0
"""Silence for longer is no time-out of anything that moves."""
_CURVES = ("rtt_ms", "loss", "picture_ms")
_DEFAULTS = SlowDownCurves()


class FieldBounds(ConfigModel):
    """Bounds how far and how fast one number of the message may go, in the message's own unit."""

    kind: MotionKind | None = Field(
        default=None,
        description="`velocity`: 0 is a standstill; `position`: 0 is a place like any other. Default: what the "
        "connector says, else `velocity`.",
    )
    min: float | None = Field(default=None, description="Least value; of a velocity at most 0.")
    max: float | None = Field(default=None, description="Greatest value; of a velocity at least 0.")
    max_rise_per_s: float | None = Field(
        default=None, gt=0, description="Fastest change of a velocity away from zero, per second."
    )
    max_fall_per_s: float | None = Field(
        default=None, gt=0, description="Fastest change of a velocity towards zero, per second."
    )
    max_rate_per_s: float | None = Field(
        default=None, gt=0, description="Fastest change of a position in any direction, per second."
    )

    def limit(self, field: str, kind: MotionKind = "velocity") -> FieldLimit:
        """As the limit of ``field``, which is of this ``kind`` where nothing else is said. Raises
        :class:`~mosaic_core.words.limits.ImpossibleLimit`."""
        return FieldLimit(
            (field,),
            self.min,
            self.max,
            None,
            self.max_rise_per_s,
            self.max_fall_per_s,
            self.max_rate_per_s,
            self.kind or kind,
        )

    def over(self, others: FieldBounds) -> FieldBounds:
        """These bounds, and those of ``others`` where these say nothing."""
        return others.model_copy(update={name: getattr(self, name) for name in self.model_fields_set})


class SlowDown(ConfigModel):
    """Curves that say how much of the speed is left on a bad link; the least of all curves counts. `off` switches one
    off."""

    rtt_ms: CurveInFile = _DEFAULTS.rtt_ms or "off"
    loss: CurveInFile = _DEFAULTS.loss or "off"
    picture_ms: CurveInFile = _DEFAULTS.picture_ms or "off"
    picture: PictureRule = Field(
        default=_DEFAULTS.picture,
        description="`if_watching`: the age of the picture counts once one is shown; `required`: no picture, no speed.",
    )

    @model_validator(mode="before")
    @classmethod
    def _nothing_is_absent(cls, data: object) -> object:
        """YAML reads a bare ``off`` as false, and nothing at all switches a curve off too."""
        if not isinstance(data, dict):
            return data
        switched = {key: "off" for key in _CURVES if key in data and data[key] in (None, False)}
        if data.get("picture") is False:
            switched["picture"] = "off"
        return {key: value for key, value in {**data, **switched}.items() if value is not None}

    @model_validator(mode="after")
    def _curves_are_curves(self) -> SlowDown:
        self.curves()
        return self

    def curves(self) -> SlowDownCurves:
        rtt_ms, loss, picture_ms = (
            None if curve == "off" else curve for curve in (self.rtt_ms, self.loss, self.picture_ms)
        )
        return SlowDownCurves(rtt_ms, loss, picture_ms, self.picture)


class SafetyConfig(ConfigModel):
    """Limits that the framework enforces for a receiver, whatever its plugin does."""

    timeout_s: float | None = Field(
        default=None, gt=0, le=MAX_TIMEOUT_S, description="Silence after which the safe action runs."
    )
    on_timeout: SafePolicy = Field(
        default="callback",
        description="On silence: `callback` runs the connector's safe action, `zero` then also sends it zeros for 1 s, "
        "`hold` does nothing.",
    )
    on_loss: SafePolicy | None = Field(
        default=None, description="The same when the commanding operator's link is lost; default: as `on_timeout`."
    )
    requires_lease: bool | None = Field(
        default=None, description="Take commands only from the lease's holder; default: the connector's own."
    )
    resource: ResourceName = Field(default="motion", description="Whose lease: a name of your own separates an arm.")
    max_rate_hz: float | None = Field(default=None, gt=0, le=1000, description="Commands per second and operator.")
    limits: dict[FieldPath, FieldBounds] = Field(
        default_factory=dict,
        description="FieldBounds by dotted path of the JSON message (`linear.x`); in a list `positions.shoulder`, by "
        "index `positions.0`, and `positions.*` for all that are not named themselves or leave a bound out. What the "
        "connector's class says holds for the bounds that are left out.",
    )
    slow_down: SlowDown | Literal["off"] | None = Field(
        default=None, description="Less speed on a bad link; default: on where the connector names motion fields."
    )

    @field_validator("slow_down", mode="before")
    @classmethod
    def _off_is_a_word(cls, value: Any) -> Any:
        return "off" if value is False else value

    def field_limits(self) -> tuple[FieldLimit, ...]:
        """A connector's own limits; a subclass overrides it to turn its own keys into limits of fields or vectors."""
        return ()


class ControlConfig(ConfigModel):
    """Rules who may command, for the whole robot."""

    legacy_peers: Literal["allow", "observe", "refuse"] = Field(
        default="allow",
        description="Original dashboards, which know no lease: they may command while nobody else does, watch, or not "
        "connect.",
    )
    lease_expiry_s: float = Field(
        default=2.0, ge=0.5, le=60, description="Silence of the holder after which its lease ends."
    )
    journal_file: str | None = Field(
        default=None, description="Also write who did what to this file, as JSON lines; it is rotated."
    )
