"""Files of original robots load unchanged, and their dashboards get the keys that they know."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from support.devices.ros_side import encoded
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

ORIGINAL = """
server:
  ws_url: ws://127.0.0.1:8080
  auth: { type: simple-token, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11, params: { token: t } }
connectors:
  - { type: ros2-sender-sensor-Image, label: camera, params: { topic_name: "/camera/image_raw", recordable: "true" } }
  - type: ros2-sender-sensor-PointCloud2
    label: lidar
    params: { topic_name: /points, parallel_num: "3", stream_mode: progressive, voxel_size: "0.5", min_points_to_subdivide: "10" }
  - { type: ros2-sender-sensor-PointCloud2, label: lidar_main, params: { topic_name: /points, parallel_num: "1" } }
  - { type: ros2-sender-sensor-NavSatFix, label: gps, params: { topic_name: /fix } }
  - { type: ros2-sender-geometry-Pose, label: pose, params: { topic_name: /pose } }
  - { type: ros2-sender-geometry-PoseWithCovarianceStamped, label: amcl, params: { topic_name: /amcl_pose } }
  - { type: ros2-receiver-geometry-Twist, label: cmd_vel, params: { topic_name: /cmd_vel } }
  - { type: ros2-receiver-geometry-TwistStamped, label: cmd_vel_stamped, params: { topic_name: cmd_vel_stamped } }
"""  # noqa: E501 - as such files have it


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


@pytest.mark.parametrize("name", ["/", "", "a//b", "a b", "1a"])
def test_a_topic_that_can_not_be_is_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mosaic_config.yaml"
    file.write_text(f"connectors: [{{ type: ros2-image, label: a, params: {{ topic: {json.dumps(name)} }} }}]")
    done = CliRunner().invoke(app, ["validate", str(file)])
    assert done.exit_code == 2
    assert "is no name of ROS" in done.output
