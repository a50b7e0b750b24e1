"""What a model has is read from its file; what is wrong with a file is said in MuJoCo's words, with file and line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mosaic_core import ConfigError
from mosaic_core.testing import build
from mosaic_mujoco.connectors.camera import MujocoCameraConfigurer
from mosaic_mujoco.connectors.gripper_target import MujocoGripperTargetConfigurer
from mosaic_mujoco.connectors.joint_target import MujocoJointTargetConfigurer, reach
from mosaic_mujoco.connectors.joints import MujocoJointsConfigurer
from mosaic_mujoco.connectors.odometry import MujocoOdometryConfigurer, base_of
from mosaic_mujoco.world.facts import Span
from mosaic_mujoco.world.model_file import ModelUnreadable, facts_of_file

if TYPE_CHECKING:
    from conftest import ModelWriter

ACTUATED = """
<worldbody>
  <body name="rail"><joint name="slide" type="slide" axis="1 0 0" range="-1 2"/><geom size=".1"/></body>
  <body name="wheel"><joint name="turn" axis="0 1 0"/><geom size=".1"/></body>
</worldbody>
<actuator>
  <position name="servo" joint="slide" kp="10" gear="4" ctrlrange="-2 6"/>
  <velocity name="roll" joint="turn" kv="2"/>
  <motor name="push" joint="turn"/>
  <general name="lift" joint="turn" gainprm="3" biastype="affine" biasprm="0 -3 -1"/>
  <intvelocity name="sums" joint="turn" kp="1" actrange="-1 1"/>
</actuator>
<sensor><jointpos name="at" joint="slide"/><jointvel name="speed" joint="turn"/><clock name="now"/></sensor>
"""


def test_the_arm_has_servos_for_all_joints_but_the_coupled_finger() -> None:
    facts = facts_of_file("arm")
    assert facts.cameras == ("overview", "wrist")
    assert list(facts.servos()) == [
        "base_yaw", "shoulder", "elbow", "forearm_roll", "wrist_pitch", "wrist_roll", "left_finger",
    ]  # fmt: skip
    assert facts.keys == ("home", "upright")
    assert facts.joint("elbow").range == Span(-2.4, 2.4)


def test_the_kind_of_an_actuator_is_what_its_gains_make_of_it(written: ModelWriter) -> None:
    facts = facts_of_file(written(ACTUATED))
    assert {one.name: one.kind for one in facts.actuators} == {
        "servo": "position", "roll": "velocity", "push": "other", "lift": "position", "sums": "other",
    }  # fmt: skip


def test_units_follow_the_kind_of_the_joint(written: ModelWriter) -> None:
    facts = facts_of_file(written(ACTUATED))
    assert [(one.name, one.unit) for one in facts.sensors] == [("at", "m"), ("speed", "rad/s"), ("now", "s")]
    assert facts.joint("slide").unit == "m"


def test_a_joint_reaches_as_far_as_its_servo_and_its_stops_go(written: ModelWriter) -> None:
    facts = facts_of_file(written(ACTUATED))
    assert reach(facts.joint("slide"), facts.servos()["slide"]) == Span(-0.5, 1.5)  # the signal through its gear
    assert reach(facts.joint("turn"), facts.servos()["turn"]) is None


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (Span(0, 2), Span(1, 3), Span(1, 2)),
        (Span(0, 2), None, Span(0, 2)),
        (Span(0, 1), Span(2, 3), Span(0, 1)),
    ],
)
def test_spans_have_what_both_have(first: Span, second: Span | None, expected: Span) -> None:
    assert first.within(second) == expected


def test_the_vehicle_is_the_floating_body_that_carries_wheels_and_not_the_crate() -> None:
    assert base_of(facts_of_file("vehicle")) == "chassis"
    assert base_of(facts_of_file("arm")) is None


def test_a_file_that_changes_is_read_again(written: ModelWriter) -> None:
    path = written("<worldbody><camera name='first'/></worldbody>")
    assert facts_of_file(path).cameras == ("first",)
    written("<worldbody><camera name='another'/></worldbody>")
    assert facts_of_file(path).cameras == ("another",)


@pytest.mark.parametrize(
    ("inner", "place", "words"),
    [
        ("\n<worldbody>\n<geom type='blob' size='1'/>\n</worldbody>", "own.xml:3", "invalid keyword: 'blob'"),
        ("\n<worldbody>\n<geom size='1'>\n</worldbody>", "own.xml:", "XML"),
        ("<asset><mesh name='m' file='gone.stl'/></asset>", "own.xml", "gone.stl"),
        ("<worldbody><body><joint/></body></worldbody>", "own.xml", "mass and inertia"),
    ],
)
def test_a_file_that_is_wrong_is_told_in_mujocos_words_with_its_place(
    written: ModelWriter, inner: str, place: str, words: str
) -> None:
    with pytest.raises(ModelUnreadable) as told:
        facts_of_file(written(inner))
    assert place in str(told.value)
    assert words in str(told.value)


def test_a_file_that_is_not_there_is_told_with_the_models_that_are() -> None:
    with pytest.raises(ModelUnreadable, match="did you mean 'arm'"):
        facts_of_file("amr")


def test_mujoco_leaves_no_log_behind(written: ModelWriter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelUnreadable):
        facts_of_file(written("<nothing/>"))
    assert [path.name for path in tmp_path.iterdir()] == ["own.xml"]


@pytest.mark.parametrize(
    ("configurer", "params", "path", "words"),
    [
        (MujocoCameraConfigurer, {"camera": "overveiw"}, "params.camera", "did you mean 'overview'? It has overview"),
        (MujocoJointTargetConfigurer, {"joints": ["elbo"]}, "params.joints", "did you mean 'elbow'?"),
        (MujocoJointTargetConfigurer, {"joints": ["right_finger"]}, "params.joints", "joint with a position actuator"),
        (MujocoJointsConfigurer, {"joints": ["elbow", "wrist"]}, "params.joints", "no joint 'wrist'"),
        (MujocoGripperTargetConfigurer, {"actuator": "griper"}, "params.actuator", "did you mean 'gripper'?"),
        (MujocoGripperTargetConfigurer, {"actuator": "gripper", "closed": 0.04}, "params", "are the same"),
        (MujocoOdometryConfigurer, {}, "params", "Say `body`; it has view, base"),
        (MujocoOdometryConfigurer, {"body": "bse"}, "params.body", "did you mean 'base'?"),
    ],
)
def test_a_name_that_the_model_does_not_have_is_told_where_it_stands(
    configurer: type, params: dict[str, object], path: str, words: str
) -> None:
    with pytest.raises(ConfigError) as told:
        build(configurer, params={"model": "arm", **params})
    (problem,) = told.value.problems
    assert problem.path == path
    assert words in problem.message


def test_a_model_that_can_not_be_read_is_one_mistake_and_not_one_for_each_name() -> None:
    with pytest.raises(ConfigError) as told:
        build(MujocoCameraConfigurer, params={"model": "nowhere.xml", "camera": "front"})
    assert [problem.path for problem in told.value.problems] == ["params.model"]
