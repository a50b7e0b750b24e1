"""An arm that is moved by lists is limited joint by joint, by its class and by the file, and what can't be is told."""

from __future__ import annotations

from typing import Any

import pytest
from support.refused_start import problems_at_start

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, FieldBounds, NoParams
from mosaic_core.messages import JointTarget
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.testing import Silence, build, feed
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.limits import FieldLimit


class Arm(DataChannelReceivable[JointTarget]):
    """Two joints, each where it was sent last."""

    timeout_s = 0.5
    requires_lease = True
    resource = "arm"
    item_names = ("shoulder", "elbow")
    limits = {  # noqa: RUF012 - as an author writes it
        "positions.*": FieldBounds(min=-2.0, max=2.0, max_rate_per_s=1.0),
        "positions.elbow": FieldBounds(min=0.5),
    }

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.is_at = {"shoulder": 0.0, "elbow": 1.0}
        self.sent: list[dict[str, float]] = []

    def reported_position(self, field: str) -> float | None:
        return self.is_at.get(field.removeprefix("positions."))

    def handle_data(self, data: JointTarget) -> None:
        self.sent.append(dict(zip(data.names, data.positions, strict=True)))
        self.is_at |= self.sent[-1]

    def make_safe(self, cause: str) -> None:
        """It holds by itself."""


class ArmConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "arm"

    def configure(self) -> Arm:
        return Arm(self.label)


def safety_of(**safety: Any) -> ReceiverSafety:
    return ReceiverSafety.of(SafetyConfig.model_validate(safety), Arm("arm"))


def limit(joint: str, low: float | None, high: float | None, rate: float | None) -> FieldLimit:
    return FieldLimit((f"positions.{joint}",), low, high, max_rate_per_s=rate, kind="position")


def test_what_its_class_says_is_in_force() -> None:
    it = safety_of()
    assert it.limits == (limit("*", -2, 2, 1), limit("elbow", 0.5, 2, 1))
    assert (it.timeout_s, it.resource, it.is_slowed) == (0.5, "arm", True)
    assert it.position_fields == ("positions.*", "positions.elbow")


def test_the_file_overrides_each_bound_that_it_says_and_no_other() -> None:
    it = safety_of(limits={"positions.elbow": {"max": 1.5}, "positions.*": {"max_rate_per_s": 0.2}}, resource="left")
    assert it.limits == (limit("*", -2, 2, 0.2), limit("elbow", 0.5, 1.5, 0.2))
    assert it.resource == "left"


def test_a_lease_that_the_file_takes_away_is_none() -> None:
    assert safety_of(requires_lease=False).resource is None


@pytest.mark.parametrize(
    ("field", "bounds", "path", "message", "cure"),
    [
        (
            "positions.elbo",
            {"max": 1},
            "positions.elbo",
            "the messages of connector 'a' have no number 'positions.elbo'",
            "did you mean 'positions.elbow'?",
        ),
        (
            "positions",
            {"max": 1},
            "positions",
            "the messages of connector 'a' have no number 'positions'",
            "did you mean 'positions.*'?",
        ),
        (
            "positions.elbow",
            {"kind": "velocity"},
            "positions.elbow.kind",
            "'positions.elbow' is a position to connector 'a', and can't be limited as a velocity",
            "remove `kind`, or name it in motion_fields of its class if that is what it is",
        ),
        (
            "positions.elbow",
            {"max": 0.2},
            "positions.elbow.max",
            "connector 'a': limit of positions.elbow: min 0.5 is above max 0.2, so no position is left",
            "min 0.5 is of Arm: write a max of at least 0.5, or a min of your own",
        ),
        (
            "positions.elbow",
            {"min": 3.5},
            "positions.elbow.min",
            "connector 'a': limit of positions.elbow: min 3.5 is above max 2, so no position is left",
            "max 2 is of Arm: write a min of at most 2, or a max of your own",
        ),
        (
            "positions.elbow",
            {"min": 2, "max": 1},
            "positions.elbow.min",
            "connector 'a': limit of positions.elbow: min 2 is above max 1, so no position is left",
            "swap them",
        ),
        (
            "positions.*",
            {"max_rise_per_s": 1},
            "positions.*.max_rise_per_s",
            "connector 'a': limit of positions.*: max_rise_per_s is for a velocity, and this is a position",
            "write max_rate_per_s, which holds in any direction",
        ),
    ],
)
def test_a_limit_of_the_file_that_nothing_can_follow_is_told_at_its_place(
    field: str, bounds: dict[str, Any], path: str, message: str, cure: str
) -> None:
    (problem,) = problems_at_start(ArmConfigurer, label="a", safety={"limits": {field: bounds}})
    assert (problem.path, problem.message) == (f"connectors[0].safety.limits.{path}", message)
    assert cure in problem.cure


def test_an_operator_moves_each_joint_no_faster_and_no_further_than_it_may() -> None:
    arm = build(ArmConfigurer, safety={"slow_down": "off"})
    wish = {"names": ["elbow", "shoulder"], "positions": [0.0, 3.0]}
    fed = feed(arm, [wish, Silence(0.1), wish, {"names": ["wrist"], "positions": [0.0]}])
    assert [one.code for one in fed.refused] == ["safety.out_of_range"]
    assert arm.sent == [
        {"elbow": pytest.approx(0.9), "shoulder": pytest.approx(0.1)},
        {"elbow": pytest.approx(0.8), "shoulder": pytest.approx(0.2)},
    ]


def test_after_a_time_out_it_begins_where_it_is() -> None:
    arm = build(ArmConfigurer, safety={"slow_down": "off"})
    stay = {"names": ["elbow"], "positions": [1.0]}
    fed = feed(arm, [stay, Silence(3.0), stay])
    assert [made.cause for made in fed.made_safe] == ["safety.timeout"]
    assert arm.sent == [{"elbow": 1.0}, {"elbow": 1.0}]
