"""Standard messages as messages of ROS and back: rosbags reads what is encoded, and what it writes is read again."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from support.devices.ros_side import STORE
from support.message_strategies import STRATEGIES

from mosaic_core.messages import (
    STANDARD_MESSAGES,
    GpsFix,
    ImageAnnotations,
    ImageBox,
    ImageLine,
    ImagePoint,
    JointTarget,
    LaserScan,
    Pose,
    Range,
    Temperature,
)
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.conversion.conversions import CONVERSIONS
from mosaic_ros2.conversion.parts import Origin
from mosaic_ros2.definitions.type_book import TypeBook

BOOK = TypeBook(shares=())
BOTH_WAYS = sorted(name for name, one in CONVERSIONS.items() if one.fields is not None)
LOST: Mapping[str, set[str]] = {
    "diagnostic_msgs/msg/DiagnosticStatus": {"timestamp"},
    "foxglove_msgs/msg/ImageAnnotations": {"camera", "width", "height", "captured_at_us"},
    "geometry_msgs/msg/Pose": {"frame_id", "timestamp"},
    "sensor_msgs/msg/NavSatFix": {"satellites", "hdop", "vdop", "speed_mps", "course_rad"},
}
"""What a type of ROS has no place for."""


def encoded(name: str, message: Any, origin: Origin = Origin()) -> bytes:  # noqa: B008 - immutable
    fields = CONVERSIONS[name].fields
    assert fields is not None
    return CdrEncoder(BOOK, name).encode(fields(message, origin))


def read_by_rosbags(name: str, data: bytes) -> Any:
    return STORE.deserialize_cdr(data, name)


def returned(name: str, message: Any, origin: Origin = Origin()) -> Any:  # noqa: B008
    """The message by way of ROS, where rosbags has read and written it."""
    data = encoded(name, message, origin)
    again = bytes(STORE.serialize_cdr(read_by_rosbags(name, data), name))
    assert again == data
    (back,) = CONVERSIONS[name].convert(Decoder(BOOK, name).decode(again))
    assert type(back) is type(message)
    return back


def kept(name: str, message: Any) -> Any:
    """What of a message can come back: values that ROS has a place for, empty text and a time of 0 as none, and for
    what is absent that which ROS has in its place."""
    told = message.model_dump(mode="json", exclude_none=True, exclude=LOST.get(name))
    return _REPLACED.get(name, lambda one: one)(_pruned(told))


def _pruned(value: Any) -> Any:
    if isinstance(value, dict):
        empty = {"frame_id": "", "child_frame_id": "", "hardware_id": "", "name": "", "timestamp": 0, "max_effort": 0}
        return {
            key: _pruned(inner)
            for key, inner in value.items()
            if inner is not None and (key not in empty or inner != empty[key])
        }
    return [_pruned(one) for one in value] if isinstance(value, list) else value


def _grid(told: dict[str, Any]) -> dict[str, Any]:
    return {**told, "origin": {key: told["origin"][key] for key in ("position", "orientation")}}


def _odometry(told: dict[str, Any]) -> dict[str, Any]:
    return {"child_frame_id": "base_link", **told}


def _path(told: dict[str, Any]) -> dict[str, Any]:
    """Poses that say neither frame nor time have those of their path."""
    own = {key: told[key] for key in ("frame_id", "timestamp") if key in told}
    return {**told, "poses": [{**own, **one} for one in told["poses"]]}


def _fix(told: dict[str, Any]) -> dict[str, Any]:
    return {**told, "fix": "gps"}


def _stick(told: dict[str, Any]) -> dict[str, Any]:
    """Axes and buttons are told by their places alone."""
    return {**told, "axis_names": [], "button_names": []}


def _range(told: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in told.items() if (key, value) != ("radiation", "radar")}


def _diagnostic(told: dict[str, Any]) -> dict[str, Any]:
    return {"name": "", **told}


def _annotations(told: dict[str, Any]) -> dict[str, Any]:
    """Labels of boxes are words then, and what has no color has one."""
    color = {"color": "#00e676"}
    labels = [
        {"x": one["x"], "y": one["y"], "text": one["label"].strip(), **color}
        for one in told["boxes"]
        if one.get("label", "").strip()
    ]
    boxes = [{**color, **{key: value for key, value in one.items() if key != "label"}} for one in told["boxes"]]
    lines = [{**color, **one} for one in told["lines"]]
    marked = {**told, "boxes": boxes, "lines": lines, "texts": [*labels, *told["texts"]]}
    return marked if boxes or lines or marked["texts"] else {key: marked[key] for key in ("boxes", "lines", "texts")}


_REPLACED: Mapping[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "diagnostic_msgs/msg/DiagnosticArray": _diagnostic,
    "diagnostic_msgs/msg/DiagnosticStatus": _diagnostic,
    "foxglove_msgs/msg/ImageAnnotations": _annotations,
    "nav_msgs/msg/OccupancyGrid": _grid,
    "nav_msgs/msg/Odometry": _odometry,
    "nav_msgs/msg/Path": _path,
    "sensor_msgs/msg/Joy": _stick,
    "sensor_msgs/msg/NavSatFix": _fix,
    "sensor_msgs/msg/Range": _range,
}


def assert_close(found: Any, wanted: Any) -> None:
    """Equal, up to what single precision and millimetres leave of a number."""
    if isinstance(wanted, dict):
        assert found.keys() == wanted.keys()
        for key, value in wanted.items():
            assert_close(found[key], value)
    elif isinstance(wanted, list):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted, strict=True):
            assert_close(one, other)
    elif isinstance(wanted, float):
        assert found == pytest.approx(wanted, rel=1e-6, abs=6e-4)
    else:
        assert found == wanted


def test_every_standard_message_has_a_conversion_both_ways() -> None:
    for message in STANDARD_MESSAGES.values():
        conversion = CONVERSIONS[message.ros_type]
        assert conversion.message is message
        assert conversion.fields is not None


@pytest.mark.parametrize("name", BOTH_WAYS)
@given(data=st.data())
def test_a_standard_message_comes_back_from_ros_as_it_went(name: str, data: st.DataObject) -> None:
    message = data.draw(STRATEGIES[CONVERSIONS[name].message])
    assume("\\u0000" not in message.model_dump_json())
    back = returned(name, message)
    assert_close(back.model_dump(mode="json", exclude_none=True), kept(name, message))
    # What came from ROS goes there and back without any change.
    assert_close(returned(name, back).model_dump(mode="json"), back.model_dump(mode="json"))


def test_what_a_message_does_not_say_its_origin_does() -> None:
    origin = Origin(2_000_005, "lidar")
    scan = LaserScan(angle_min=0, angle_max=0, angle_increment=1, range_max=9, ranges=[1.0])
    found = read_by_rosbags("sensor_msgs/msg/LaserScan", encoded("sensor_msgs/msg/LaserScan", scan, origin))
    assert (found.header.frame_id, found.header.stamp.sec, found.header.stamp.nanosec) == ("lidar", 2, 5000)
    own = scan.model_copy(update={"frame_id": "front", "timestamp": 1_000_000})
    found = read_by_rosbags("sensor_msgs/msg/LaserScan", encoded("sensor_msgs/msg/LaserScan", own, origin))
    assert (found.header.frame_id, found.header.stamp.sec) == ("front", 1)


def test_no_return_is_infinity_in_ros_and_no_measurement_nan() -> None:
    scan = LaserScan(angle_min=0, angle_max=1, angle_increment=1, range_max=9, ranges=[None, 1e300])
    found = read_by_rosbags("sensor_msgs/msg/LaserScan", encoded("sensor_msgs/msg/LaserScan", scan))
    assert found.ranges.tolist() == [math.inf, math.inf]
    ahead = read_by_rosbags("sensor_msgs/msg/Range", encoded("sensor_msgs/msg/Range", Range(range=None, range_max=4)))
    assert (ahead.range, ahead.radiation_type) == (math.inf, 255)
    place = GpsFix(latitude=None, longitude=None, altitude=None)
    fix = read_by_rosbags("sensor_msgs/msg/NavSatFix", encoded("sensor_msgs/msg/NavSatFix", place))
    assert math.isnan(fix.latitude)
    assert fix.status.status == -1


def test_how_sure_a_place_is_becomes_a_covariance_and_back() -> None:
    place = GpsFix(latitude=48.0, longitude=11.0, altitude=500.0, accuracy_m=4.9, fix="rtk")
    name = "sensor_msgs/msg/NavSatFix"
    found = read_by_rosbags(name, encoded(name, place))
    assert found.position_covariance.reshape(3, 3).diagonal().tolist() == pytest.approx([4, 4, 16])
    assert (found.position_covariance_type, found.status.status) == (1, 2)
    assert returned(name, place).accuracy_m == pytest.approx(4.9)


def test_text_that_ros_can_not_carry_and_times_that_it_does_not_know_are_refused() -> None:
    with pytest.raises(CdrError, match="text with a zero in it"):
        encoded("geometry_msgs/msg/PoseStamped", Pose(position={"x": 0, "y": 0}, frame_id="a\0b"))  # type: ignore[arg-type]
    with pytest.raises(CdrError, match="sec"):
        encoded("sensor_msgs/msg/Temperature", Temperature(temperature_c=1, timestamp=10**16))


def test_of_a_trajectory_the_end_is_the_target_and_one_without_points_is_none() -> None:
    name = "trajectory_msgs/msg/JointTrajectory"
    points = [{"positions": [1.0]}, {"positions": [2.0], "time_from_start": {"sec": 3}}]
    message = Decoder(BOOK, name).decode(CdrEncoder(BOOK, name).encode({"joint_names": ["a"], "points": points}))
    assert list(CONVERSIONS[name].convert(message)) == [JointTarget(names=["a"], positions=[2.0], duration_s=3.0)]
    hold = Decoder(BOOK, name).decode(CdrEncoder(BOOK, name).encode({"joint_names": ["a"]}))
    assert list(CONVERSIONS[name].convert(hold)) == []


def test_circles_and_lists_of_lines_are_marks_too() -> None:
    name = "foxglove_msgs/msg/ImageAnnotations"
    red = {"r": 1.0, "a": 1.0}
    corners = [{"x": 0.0, "y": 0.0}, {"x": 4.0, "y": 0.0}, {"x": 4.0, "y": 3.0}, {"x": 0.0, "y": 3.0}]
    fields = {
        "circles": [{"position": {"x": 10.0, "y": 20.0}, "diameter": 4.0, "outline_color": red}],
        "points": [{"type": kind, "points": corners, "outline_color": red} for kind in (1, 2, 3, 4)],
    }
    (found,) = CONVERSIONS[name].convert(Decoder(BOOK, name).decode(CdrEncoder(BOOK, name).encode(fields)))
    assert isinstance(found, ImageAnnotations)
    circle, *others = found.lines
    assert circle.closed
    assert {round(math.hypot(one.x - 10, one.y - 20), 6) for one in circle.points} == {2.0}
    assert [len(one.points) for one in others] == [1, 1, 1, 1, 4, 2, 2]
    assert found.boxes == [ImageBox(x=0, y=0, width=4, height=3, color="#ff0000")]


def test_a_box_says_what_it_found_beside_it() -> None:
    name = "foxglove_msgs/msg/ImageAnnotations"
    marks = ImageAnnotations(
        boxes=[ImageBox(x=1, y=2, width=3, height=4, label="cup", score=0.87)],
        lines=[ImageLine(points=[ImagePoint(x=1, y=1)])],
    )
    found = read_by_rosbags(name, encoded(name, marks))
    assert [one.text for one in found.texts] == ["cup 87%"]
    assert [one.type for one in found.points] == [2, 1]
