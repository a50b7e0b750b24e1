"""Files of original robots load unchanged, and their dashboards get the keys that they know."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from support.devices.ros_side import encoded
from support.original_ros2_file import ORIGINAL_CONNECTORS
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_core.testing import build
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.original_senders import (
    OriginalCovariancePoseConfigurer,
    OriginalFixConfigurer,
    OriginalPoseConfigurer,
)
from mosaic_ros2.definitions.type_book import TypeBook

ORIGINAL = f"""
server:
  ws_url: ws://127.0.0.1:8080
  auth: {{ type: simple-token, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11, params: {{ token: t }} }}
connectors:
{ORIGINAL_CONNECTORS}"""


def test_a_file_of_an_original_robot_loads_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "mosaic_config.yaml"
    file.write_text(ORIGINAL)
    done = CliRunner().invoke(app, ["validate", str(file)])
    assert done.exit_code == 0, done.output


def sent(configurer: Any, name: str, values: dict[str, Any]) -> dict[str, Any]:
    handler = build(configurer, params={"topic_name": "/x"})
    message = Decoder(TypeBook(shares=()), name).decode(encoded(name, values))
    (made,) = handler.conversion.convert(message)
    return json.loads(made.model_dump_json())  # type: ignore[no-any-return]


def test_a_pose_has_position_orientation_and_microseconds() -> None:
    found = sent(OriginalPoseConfigurer, "geometry_msgs/msg/Pose", {"position": {"x": 1.0}, "orientation": {"w": 1.0}})
    assert found.keys() == {"position", "orientation", "timestamp"}
    assert found["timestamp"] > 1_600_000_000_000_000
    assert found["position"] == {"x": 1.0, "y": 0.0, "z": 0.0}


def test_a_pose_with_covariance_is_there_for_the_map_widget_too() -> None:
    values = {"header": {"stamp": {"sec": 3}}, "pose": {"pose": {"position": {"x": 2.0}}}}
    found = sent(OriginalCovariancePoseConfigurer, "geometry_msgs/msg/PoseWithCovarianceStamped", values)
    assert found["pose"]["position"]["x"] == found["position"]["x"] == 2.0
    assert found["timestamp"] == 3_000_000


def test_a_fix_has_latitude_longitude_altitude_and_microseconds() -> None:
    values = {"header": {"stamp": {"sec": 3}}, "latitude": 37.5, "longitude": 127.0, "altitude": 30.0}
    found = sent(OriginalFixConfigurer, "sensor_msgs/msg/NavSatFix", values)
    wanted = {"latitude": 37.5, "longitude": 127.0, "altitude": 30.0, "timestamp": 3_000_000}
    assert wanted.items() <= found.items()


def test_what_has_no_time_gets_that_of_its_arrival() -> None:
    for configurer, name in (
        (OriginalFixConfigurer, "sensor_msgs/msg/NavSatFix"),
        (OriginalCovariancePoseConfigurer, "geometry_msgs/msg/PoseWithCovarianceStamped"),
    ):
        assert sent(configurer, name, {})["timestamp"] > 1_600_000_000_000_000


@pytest.mark.parametrize("name", ["/", "", "a//b", "a b", "1a"])
def test_a_topic_that_can_not_be_is_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mosaic_config.yaml"
    file.write_text(f"connectors: [{{ type: ros2-image, label: a, params: {{ topic: {json.dumps(name)} }} }}]")
    done = CliRunner().invoke(app, ["validate", str(file)])
    assert done.exit_code == 2
    assert "is no name of ROS" in done.output
