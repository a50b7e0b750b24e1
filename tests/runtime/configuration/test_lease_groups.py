"""Two resources that are probably one: a slip of the finger, and not two arms."""

from __future__ import annotations

import pytest

from mosaic_core.runtime.configuration.lease_groups import is_probably


@pytest.mark.parametrize(
    ("one", "other"), [("arm", "amr"), ("arm", "arn"), ("arm", "arms"), ("gripper", "griper"), ("left_arm", "left-arm")]
)
def test_one_slip_makes_two_names_alike_either_way(one: str, other: str) -> None:
    assert is_probably(one, other)
    assert is_probably(other, one)


@pytest.mark.parametrize(
    ("one", "other"),
    [("arm1", "arm2"), ("arm_l", "arm_r"), ("arm", "motion"), ("arm", "mra"), ("arm_9", "arm_10"), ("lift", "left2")],
)
def test_names_that_tell_two_things_apart_are_left_alone(one: str, other: str) -> None:
    assert not is_probably(one, other)
    assert not is_probably(other, one)
