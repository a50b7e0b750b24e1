"""`mosaic mujoco show` lists what a model has, `init` writes a robot's file that is valid."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.words.errors import MosaicError
from mosaic_mujoco.cli.robot_file import MAX_SENSORS, WheelSizes, connectors_of, gripper_of
from mosaic_mujoco.cli.written import write_robot
from mosaic_mujoco.world.model_file import facts_of_file

if TYPE_CHECKING:
    from conftest import ModelWriter


def run(*words: str) -> str:
    done = CliRunner().invoke(app, ["mujoco", *words])
    assert done.exit_code == 0, done.output
    return done.output


def written_connectors(path: Path) -> dict[str, dict[str, Any]]:
    """By label; the file is valid."""
    validation = validate_file(path)
    assert not validation.problems
    return {one["label"]: one for one in yaml.safe_load(path.read_text())["connectors"]}


def test_show_has_a_line_for_each_thing_with_a_name() -> None:
    lines = [line.split() for line in run("show", "vehicle").splitlines()]
    assert ["camera", "front"] in lines
    assert ["actuator", "left_wheel", "velocity", "-25", "to", "25", "moves", "left_wheel"] in lines
    assert ["sensor", "imu_gyro", "gyro", "3", "values", "rad/s"] in lines
    assert json.loads(run("show", "arm", "--json"))["keys"] == ["home", "upright"]


def test_show_says_so_where_nothing_has_a_name(written: ModelWriter) -> None:
    assert "nothing with a name" in run("show", written("<worldbody><geom size='1'/></worldbody>"))


def test_a_model_that_can_not_be_read_is_an_error_with_a_cure(written: ModelWriter) -> None:
    with pytest.raises(MosaicError, match=r"own\.xml") as told:
        write_robot(written("<worldbody><geom/>"), Path("-"), overwrites=False)
    assert told.value.cure


def test_the_arms_file_has_its_cameras_joints_and_gripper(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    run("init", "arm", str(path))
    made = written_connectors(path)
    assert made["wrist"]["type"] == "mujoco-camera"
    assert made["arm"]["params"]["joints"][-1] == "wrist_roll"  # the gripper's finger is no joint of the arm
    assert made["gripper"]["params"]["actuator"] == "gripper"
    assert {"grasp_position", "reset", "simulation", "health"} <= set(made)
    assert "grasp_attitude" not in made  # it is told with the position


def test_the_vehicles_file_has_a_drive_whose_wheels_are_measured(tmp_path: Path) -> None:
    path = tmp_path / "vehicle.yaml"
    run("init", "vehicle", str(path))
    made = written_connectors(path)
    drive = made["cmd_vel"]["params"]["drive"]
    assert (drive["wheel_radius_m"], drive["track_width_m"]) == (0.06, 0.25)
    assert made["pose"]["params"]["body"] == "chassis"
    assert "imu_acceleration" not in made  # it is told with the gyro


def test_a_file_that_stands_there_is_kept_unless_it_is_forced(tmp_path: Path) -> None:
    path = tmp_path / "mosaic_config.yaml"
    path.write_text("mine")
    with pytest.raises(MosaicError, match="exists"):
        write_robot("arm", path, overwrites=False)
    assert path.read_text() == "mine"
    write_robot("arm", path, overwrites=True)
    assert "mujoco-camera" in path.read_text()


def test_a_file_that_can_not_be_written_is_an_error_with_a_cure(tmp_path: Path) -> None:
    with pytest.raises(MosaicError, match="can't be written: No such file or directory"):
        write_robot("arm", tmp_path / "nowhere" / "robot.yaml", overwrites=False)


def test_init_prints_where_no_file_is_wanted() -> None:
    assert yaml.safe_load(run("init", "arm", "-"))["connectors"]


def test_a_path_is_written_as_it_was_named_and_labels_are_plain_and_unlike(
    written: ModelWriter, tmp_path: Path
) -> None:
    model = written(
        "<worldbody><camera name='Front Left'/><camera name='front left'/>"
        "<body><joint name='Ärmel 1'/><geom size='.1'/></body></worldbody>"
        "<actuator><position name='Ärmel 1' joint='Ärmel 1'/></actuator>"
    )
    path = tmp_path / "robot.yaml"
    run("init", model, str(path))
    made = written_connectors(path)
    assert {"front_left", "front_left_2", "joints", "arm"} <= set(made)
    assert made["arm"]["params"] == {"model": model, "joints": ["Ärmel 1"]}


def test_a_model_without_cameras_is_looked_at_from_outside_and_one_with_many_sensors_by_the_first(
    written: ModelWriter,
) -> None:
    sensors = "".join(f"<jointpos name='s{number}' joint='j'/>" for number in range(40))
    model = written(f"<worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><sensor>{sensors}</sensor>")
    made = connectors_of(model, facts_of_file(model), WheelSizes())
    assert [one["label"] for one in made if one["type"] == "mujoco-camera"] == ["view"]
    assert sum(one["type"] == "mujoco-sensor" for one in made) == MAX_SENSORS
    assert gripper_of(facts_of_file(model)) is None


@pytest.mark.parametrize("name", ["arm", "vehicle"])
def test_the_demos_robots_are_valid(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    import mosaic_mujoco.robots

    for variable, value in {
        "MOSAIC_WS_URL": "ws://127.0.0.1:9001",
        "MOSAIC_ROBOT_ID": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11",
        "MOSAIC_TOKEN": "t",
    }.items():
        monkeypatch.setenv(variable, value)
    assert not validate_file(Path(mosaic_mujoco.robots.__file__).with_name(f"{name}.yaml")).problems
