"""Messages of ROS as standard messages: units, unknown values, and what can't be meant."""

from __future__ import annotations

import math
from typing import Any

import pytest
from support.devices.ros_side import encoded

from mosaic_core.messages import STANDARD_MESSAGES, JointTarget, Twist
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.conversion.conversions import CONVERSIONS
from mosaic_ros2.conversion.joints import positions_in, trajectory
from mosaic_ros2.conversion.parts import ros_twist
from mosaic_ros2.definitions.type_book import TypeBook

BOOK = TypeBook(shares=())
HEADER = {"stamp": {"sec": 2, "nanosec": 5000}, "frame_id": "laser"}
NAN = math.nan


def converted(name: str, values: dict[str, Any]) -> list[dict[str, Any]]:
    message = Decoder(BOOK, name).decode(encoded(name, values))
    return [one.model_dump(mode="json") for one in CONVERSIONS[name].convert(message)]


def test_every_conversion_makes_a_standard_message_of_a_bundled_type() -> None:
    for name, conversion in CONVERSIONS.items():
        assert BOOK.knows(name)
        assert conversion.message in STANDARD_MESSAGES.values()


def test_a_scan_without_returns_has_null_and_its_frame() -> None:
    values = {"header": HEADER, "angle_min": 0, "angle_max": 3, "angle_increment": 1, "range_min": 0.1, "range_max": 9}
    (scan,) = converted("sensor_msgs/msg/LaserScan", {**values, "ranges": [math.inf, NAN, 0.05, 1.23456]})
    assert scan["ranges"] == [None, None, None, 1.235]
    assert (scan["frame_id"], scan["timestamp"]) == ("laser", 2_000_005)


def test_a_scan_whose_angles_do_not_fit_is_refused() -> None:
    values = {"angle_max": 3, "angle_increment": 1, "range_max": 9, "ranges": [1.0]}
    with pytest.raises(ValueError, match="ranges has 1"):
        converted("sensor_msgs/msg/LaserScan", values)


@pytest.mark.parametrize(("percentage", "percent"), [(0.5, 50.0), (87.0, 87.0), (NAN, None), (-1.0, None), (1.0, 100)])
def test_a_battery_tells_per_cent_and_the_current_out_of_it(percentage: float, percent: float | None) -> None:
    values = {"percentage": percentage, "voltage": 24.5, "current": -2.0, "temperature": NAN}
    (battery,) = converted("sensor_msgs/msg/BatteryState", {**values, "power_supply_status": 2})
    assert battery["percent"] == percent
    assert (battery["current_a"], battery["charging"]) == (2.0, False)
    assert "temperature_c" not in battery


def test_an_imu_without_an_orientation_has_none() -> None:
    (imu,) = converted("sensor_msgs/msg/Imu", {"orientation_covariance": [-1.0, *[0.0] * 8]})
    assert "orientation" not in imu


def test_a_rotation_that_nobody_filled_in_is_none_and_others_have_the_length_1() -> None:
    (pose,) = converted("geometry_msgs/msg/Pose", {})
    assert pose["orientation"] == {"x": 0, "y": 0, "z": 0, "w": 1}
    (pose,) = converted("geometry_msgs/msg/Pose", {"orientation": {"z": 3.0, "w": 4.0}})
    assert (pose["orientation"]["z"], pose["orientation"]["w"]) == pytest.approx((0.6, 0.8))


def test_without_a_fix_there_is_no_place() -> None:
    (fix,) = converted("sensor_msgs/msg/NavSatFix", {"status": {"status": -1}, "latitude": 48.1, "longitude": 11.5})
    assert (fix["latitude"], fix["longitude"], fix["fix"]) == (None, None, "none")
    (fix,) = converted(
        "sensor_msgs/msg/NavSatFix",
        {"latitude": 48.1, "longitude": 11.5, "position_covariance": [4.0, *[0.0] * 3, 4.0, *[0.0] * 4],
         "position_covariance_type": 2},
    )  # fmt: skip
    assert (fix["latitude"], fix["accuracy_m"]) == (48.1, pytest.approx(4.9))


def test_frames_become_one_message_each_and_those_without_a_name_none() -> None:
    one = {"header": {"frame_id": "map"}, "child_frame_id": "/odom", "transform": {"rotation": {"w": 1.0}}}
    found = converted("tf2_msgs/msg/TFMessage", {"transforms": [one, {}, {**one, "child_frame_id": "b"}]})
    assert [(each["frame_id"], each["child_frame_id"]) for each in found] == [("map", "odom"), ("map", "b")]


def test_diagnostics_and_log_lines_have_words_for_levels() -> None:
    status = {"level": 2, "name": "motor", "message": "hot", "values": [{"key": "t", "value": "91"}]}
    (found,) = converted("diagnostic_msgs/msg/DiagnosticArray", {"status": [status]})
    assert (found["level"], found["values"]) == ("error", {"t": "91"})
    (line,) = converted("rcl_interfaces/msg/Log", {"level": 30, "name": "nav", "msg": "lost", "stamp": {"sec": 1}})
    assert (line["level"], line["name"], line["timestamp"]) == ("warn", "nav", 1_000_000)


def test_lists_of_joints_that_are_not_known_are_empty() -> None:
    (joints,) = converted("sensor_msgs/msg/JointState", {"name": ["a", "b"], "position": [1, 2], "velocity": [NAN, 1]})
    assert (joints["positions"], joints["velocities"], joints["efforts"]) == ([1.0, 2.0], [], [])


def test_a_range_without_a_return_is_null() -> None:
    (found,) = converted("sensor_msgs/msg/Range", {"range": math.inf, "max_range": 4, "radiation_type": 1})
    assert (found["range"], found["radiation"]) == (None, "infrared")


def test_a_stick_is_one_with_what_is_no_number_let_go_and_no_more_axes_than_there_may_be() -> None:
    message = {"header": HEADER, "axes": [0.5, NAN, *[1.0] * 100], "buttons": [0, 1]}
    (found,) = converted("sensor_msgs/msg/Joy", message)
    assert (found["axes"][:3], len(found["axes"]), found["buttons"]) == ([0.5, 0.0, 1.0], 64, [0, 1])
    assert found["frame_id"] == "laser"


def test_maps_ways_and_odometry_keep_their_frames() -> None:
    info = {"resolution": 0.5, "width": 2, "height": 1, "origin": {"orientation": {"w": 1.0}}}
    (grid,) = converted("nav_msgs/msg/OccupancyGrid", {"header": HEADER, "info": info, "data": [-1, 100]})
    assert grid["data"] == [-1, 100]
    (path,) = converted("nav_msgs/msg/Path", {"header": HEADER, "poses": [{"pose": {"position": {"x": 1.0}}}]})
    assert path["poses"][0]["position"]["x"] == 1.0
    (odometry,) = converted("nav_msgs/msg/Odometry", {"header": HEADER, "child_frame_id": "base_link"})
    assert (odometry["frame_id"], odometry["child_frame_id"]) == ("laser", "base_link")


def test_commands_become_messages_that_encode() -> None:
    twist = CdrEncoder(BOOK, "geometry_msgs/msg/Twist").encode(ros_twist(Twist.planar(0.5, yaw_radps=-1)))
    assert twist == encoded("geometry_msgs/msg/Twist", {"linear": {"x": 0.5}, "angular": {"z": -1.0}})
    target = trajectory(JointTarget(names=["a"], positions=[1.5], duration_s=2.25), 1.0)
    wanted = {"positions": [1.5], "time_from_start": {"sec": 2, "nanosec": 250_000_000}}
    sent = CdrEncoder(BOOK, "trajectory_msgs/msg/JointTrajectory").encode(target)
    assert sent == encoded("trajectory_msgs/msg/JointTrajectory", {"joint_names": ["a"], "points": [wanted]})
    state = Decoder(BOOK, "sensor_msgs/msg/JointState").decode(
        encoded("sensor_msgs/msg/JointState", {"name": ["a", "b"], "position": [1.0, NAN]})
    )
    assert positions_in(state) == {"a": 1.0}
