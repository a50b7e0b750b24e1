"""Limits of positions that make no sense are refused before anything starts, with their place and cure."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from pydantic import Field
from support.refused_start import problems_at_start

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Message, NoParams, unit
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import build, connector, joined
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import Problem
from mosaic_core.words.limits import NO_SLOW_DOWN, FieldLimit


class Wish(Message):
    angle: float = 0.0
    speed: float = 0.0
    effort: float = 0.0


class Blind(DataChannelReceivable[Wish]):
    """Says nothing of where it is."""

    motion_fields: ClassVar[tuple[str, ...]] = ("speed",)
    position_fields: ClassVar[tuple[str, ...]] = ("angle",)

    def handle_data(self, data: Wish) -> None:
        """Takes everything."""


class Arm(Blind):
    def reported_position(self, field: str) -> float | None:
        return 60.0


class NarrowSafety(SafetyConfig):
    def field_limits(self) -> tuple[FieldLimit, ...]:
        return (FieldLimit(("angle",), 0, 50, kind="position"),)


class BlindConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "blind"

    def configure(self) -> Blind:
        return Blind(self.label)


class ArmConfigurer(BlindConfigurer):
    connector_type = "arm"
    safety_model = NarrowSafety

    def configure(self) -> Arm:
        return Arm(self.label)


def problems_of(configurer: Any, safety: dict[str, Any]) -> list[Problem]:
    return problems_at_start(configurer, label="a", safety=safety)


def field(name: str, **bounds: Any) -> dict[str, Any]:
    return {"limits": {name: bounds}}


ZERO = "zero must be allowed (min <= 0 <= max), or nothing could stand still"
NO_REPORT = "connector 'a' does not report where '{}' is, so a rate can't begin anywhere"
REPORT = "let Blind implement reported_position, or remove max_rate_per_s"


@pytest.mark.parametrize(
    ("safety", "path", "message", "cure"),
    [
        (
            field("angle", kind="velocity"),
            "limits.angle.kind",
            "'angle' is a position to connector 'a', and can't be limited as a velocity",
            "remove `kind`, or name it in motion_fields of its class if that is what it is",
        ),
        (
            field("speed", kind="position"),
            "limits.speed.kind",
            "'speed' is a velocity to connector 'a', and can't be limited as a position",
            "remove `kind`, or name it in position_fields of its class if that is what it is",
        ),
        (
            field("effort", min=5),
            "limits.effort.min",
            f"connector 'a': limit of effort: {ZERO}",
            "where 0 is no standstill write `kind: position`, or name it in position_fields of its class",
        ),
        (
            field("angle", max_fall_per_s=5),
            "limits.angle.max_fall_per_s",
            "connector 'a': limit of angle: max_fall_per_s is for a velocity, and this is a position",
            "write max_rate_per_s, which holds in any direction",
        ),
        (field("angle", max_rate_per_s=5), "limits.angle.max_rate_per_s", NO_REPORT.format("angle"), REPORT),
        (
            field("effort", kind="position", max_rate_per_s=5),
            "limits.effort.max_rate_per_s",
            NO_REPORT.format("effort"),
            REPORT,
        ),
        (
            {"timeout_s": 1, "on_timeout": "zero"},
            "on_timeout",
            "connector 'a' takes 'angle' as a position, and 0 is no standstill of one",
            "write `callback`, or `hold` if it may stay where it is",
        ),
        (
            {"on_loss": "zero", **field("effort", kind="position")},
            "on_loss",
            "connector 'a' takes 'angle' and 'effort' as a position, and 0 is no standstill of one",
            "write `callback`, or `hold` if it may stay where it is",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_place_and_cure(
    safety: dict[str, Any], path: str, message: str, cure: str
) -> None:
    (problem,) = problems_of(BlindConfigurer, safety)
    assert (problem.path, problem.message, problem.cure) == (f"connectors[0].safety.{path}", message, cure)


def test_positions_that_nobody_reports_are_one_mistake() -> None:
    rates = {"angle": {"max_rate_per_s": 5}, "effort": {"kind": "position", "max_rate_per_s": 5}}
    (problem,) = problems_of(BlindConfigurer, {"limits": rates})
    told = "connector 'a' does not report where 'angle' and 'effort' are, so a rate can't begin anywhere"
    assert (problem.path, problem.message) == ("connectors[0].safety.limits.angle.max_rate_per_s", told)


def test_all_mistakes_of_the_limits_are_told_at_once() -> None:
    limits = {
        "effort": {"min": 5, "max": -5, "max_rate_per_s": 1},
        "speed": {"kind": "position", "min": 1},
        "angle": {"max_rate_per_s": 5},
        "anglo": {"max": 1},
    }
    found = problems_of(BlindConfigurer, {"timeout_s": 1, "on_timeout": "zero", "limits": limits})
    assert sorted(one.path.removeprefix("connectors[0].safety.") for one in found) == [
        "limits.angle.max_rate_per_s", "limits.anglo", "limits.effort.max", "limits.effort.max_rate_per_s",
        "limits.effort.min", "limits.speed.kind", "limits.speed.min", "on_timeout",
    ]  # fmt: skip


def test_limits_of_the_file_and_of_the_connector_must_leave_a_position() -> None:
    (problem,) = problems_of(ArmConfigurer, field("angle", min=60, max=90))
    assert problem.message == "connector 'a': no position is left for 'angle': at least 60 and at most 50"


def test_a_position_has_a_range_without_zero_a_rate_and_the_slow_down_of_what_moves() -> None:
    safety = SafetyConfig.model_validate(field("angle", min=5, max=90, max_rate_per_s=30))
    it = ReceiverSafety.of(safety, Arm("arm"))
    assert it.limits == (FieldLimit(("angle",), 5, 90, max_rate_per_s=30, kind="position"),)
    assert (it.position_fields, it.is_slowed) == (("angle",), True)


def test_the_file_may_call_a_field_a_position_of_which_the_connector_says_nothing() -> None:
    class Plain(DataChannelReceivable[Wish]):
        def handle_data(self, data: Wish) -> None:
            """Takes everything."""

    it = ReceiverSafety.of(SafetyConfig.model_validate(field("effort", kind="position", min=5)), Plain("p"))
    assert it.position_fields == ("effort",)
    assert it.curves == NO_SLOW_DOWN, "as for velocities, only the connector's own fields switch it on"


class Unsaid(DataChannelReceivable[Wish]):
    """Says where it is, and not that this is a position."""

    motion_fields: ClassVar[tuple[str, ...]] = ()

    def handle_data(self, data: Wish) -> None:
        """Takes everything."""

    def reported_position(self, field: str) -> float | None:
        return 60.0


class UnsaidConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "unsaid"

    def configure(self) -> Unsaid:
        return Unsaid(self.label)


def test_whoever_reports_positions_must_say_which_before_a_rate_is_limited() -> None:
    (problem,) = problems_of(UnsaidConfigurer, field("angle", max_rise_per_s=90, max_fall_per_s=90))
    assert "reports positions, and 'angle' is limited as a velocity: a rate would begin at 0" in problem.message
    assert problem.cure.startswith("write `kind: position` and max_rate_per_s, name it in position_fields of Unsaid")


@pytest.mark.parametrize("bounds", [{"kind": "position", "max_rate_per_s": 90}, {"max": 90}])
async def test_a_reported_position_is_no_mistake_where_the_file_calls_it_one_or_limits_no_rate(
    bounds: dict[str, Any],
) -> None:
    safety = field("angle", **bounds)
    async with joined(connector(UnsaidConfigurer, label="a", safety=safety)) as link:
        assert link.configured.connectors[0].handlers


def test_a_limit_of_the_file_that_bounds_nothing_is_refused_as_one_of_a_class_is() -> None:
    (problem,) = problems_of(BlindConfigurer, {"limits": {"angle": {}}})
    assert problem.message == "the limit of 'angle' of connector 'a' bounds nothing"
    assert problem.cure == "write min, max or a rate, or remove it"
    assert problem.path.endswith("safety.limits.angle")


class Placed(Message):
    angle_rad: float = 0.0
    reach: float = Field(default=0.0, json_schema_extra=unit("mm"))
    speed_mps: float = 0.0


class Crane(DataChannelReceivable[Placed]):
    """Says of no number whether it is a place."""

    def handle_data(self, data: Placed) -> None:
        """Takes everything."""


class CraneConfigurer(BlindConfigurer):
    connector_type = "crane"

    def configure(self) -> Crane:  # type: ignore[override]
        return Crane(self.label)


@pytest.mark.parametrize(("field", "told"), [("angle_rad", "rad"), ("reach", "mm")])
def test_what_is_given_in_the_unit_of_a_place_is_not_limited_as_a_velocity_by_default(field: str, told: str) -> None:
    (problem,) = problems_of(CraneConfigurer, {"limits": {field: {"min": -1, "max": 1, "max_rise_per_s": 0.5}}})
    assert problem.message == (
        f"'{field}' of connector 'a' is in {told}: is it a place? As a velocity it would begin at 0"
    )
    assert problem.cure == "write `kind: position` with max_rate_per_s, or `kind: velocity` if 0 is its standstill"


@pytest.mark.parametrize(
    ("field", "bounds"),
    [
        ("angle_rad", {"max": 1, "kind": "position"}),
        ("reach", {"max": 1, "max_fall_per_s": 0.5, "kind": "velocity"}),
        ("speed_mps", {"max": 1, "max_fall_per_s": 0.5}),
    ],
)
def test_a_kind_that_is_said_and_a_velocity_are_limited(field: str, bounds: dict[str, Any]) -> None:
    crane = build(CraneConfigurer, safety={"limits": {field: bounds}})
    (limit,) = ReceiverSafety.of(SafetyConfig.model_validate({"limits": {field: bounds}}), crane).limits
    assert limit.kind == bounds.get("kind", "velocity")
