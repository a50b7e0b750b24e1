"""Standard messages: ids that stay, JSON that comes back, and mistakes that are told with the field's name."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from support.message_strategies import STRATEGIES

from mosaic_core.messages import STANDARD_MESSAGES, BatteryState, StandardMessage
from mosaic_core.words.wire_model import to_json

IDS = {
    "mosaic/BatteryState@1", "mosaic/Diagnostic@1", "mosaic/GpsFix@1", "mosaic/GripperTarget@1",
    "mosaic/ImageAnnotations@1", "mosaic/Imu@1", "mosaic/JointState@1", "mosaic/JointTarget@1", "mosaic/Joy@1",
    "mosaic/LaserScan@1", "mosaic/Log@1", "mosaic/OccupancyGrid@1", "mosaic/Odometry@1", "mosaic/Path@1",
    "mosaic/Pose@1", "mosaic/Range@1", "mosaic/Temperature@1", "mosaic/Transform@1", "mosaic/Twist@1",
}  # fmt: skip
EACH = pytest.mark.parametrize("message", STANDARD_MESSAGES.values(), ids=lambda message: message.__name__)


def test_a_schema_id_never_changes_and_belongs_to_one_message() -> None:
    """Robots in the field announce these: a changed shape gets a new number beside the old one."""
    assert set(STANDARD_MESSAGES) == IDS
    assert len({message.__name__ for message in STANDARD_MESSAGES.values()}) == len(IDS)


@EACH
def test_an_id_names_its_message(message: type[StandardMessage]) -> None:
    assert re.fullmatch(rf"mosaic/{message.__name__}@[1-9]\d*", message.schema_id)


@EACH
def test_people_are_told_what_it_is_and_how_it_maps(message: type[StandardMessage]) -> None:
    assert message.__doc__
    assert message.given_in
    assert message.shape_from
    assert re.fullmatch(r"[a-z0-9_]+/msg/[A-Za-z0-9]+", message.ros_type)


@EACH
@given(data=st.data())
def test_what_is_sent_is_read_as_the_same(message: type[StandardMessage], data: st.DataObject) -> None:
    sent = data.draw(STRATEGIES[message])
    text = to_json(sent.model_dump(mode="json"))
    assert message.model_validate(json.loads(text)) == sent


@EACH
@given(data=st.data())
def test_what_is_absent_is_not_sent(message: type[StandardMessage], data: st.DataObject) -> None:
    sent = data.draw(STRATEGIES[message])
    may_be_null = {name for name, field in message.model_fields.items() if field.is_required()}
    nulls = {name for name, value in sent.model_dump(mode="json").items() if value is None}
    assert nulls <= may_be_null


@EACH
def test_what_moves_is_a_field_of_it(message: type[StandardMessage]) -> None:
    schema = message.model_json_schema()
    for path in message.motion_kinds:
        node = schema
        for name in path.split("."):
            node = node["properties"][name]
            node = schema["$defs"][node["$ref"].rsplit("/")[-1]] if "$ref" in node else node
        assert node.get("items", node)["type"] == "number", path


SCAN = {"angle_min": 0.0, "angle_max": 1.0, "angle_increment": 0.1, "range_max": 5.0, "ranges": [1.0] * 11}
GRID = {"resolution": 0.1, "width": 2, "height": 2, "origin": {"position": {"x": 0, "y": 0}}, "data": [0, 0, 0, -1]}
HERE = {"x": 0.0, "y": 0.0}


@pytest.mark.parametrize(
    ("schema_id", "wrong", "says"),
    [
        ("mosaic/LaserScan@1", SCAN | {"ranges": [1.0] * 9}, "ranges has 9 values"),
        ("mosaic/LaserScan@1", SCAN | {"ranges": [1.0] * 13}, "ranges has 13 values"),
        ("mosaic/LaserScan@1", SCAN | {"intensities": [1.0]}, "intensities has 1 values for 11 ranges"),
        ("mosaic/LaserScan@1", SCAN | {"ranges": [float("inf"), *[1.0] * 10]}, "ranges.0"),
        ("mosaic/LaserScan@1", SCAN | {"ranges": [None] * 70_000}, "ranges"),
        ("mosaic/JointState@1", {"names": ["a"], "velocities": [1.0, 2.0]}, "velocities has 2 values for 1 names"),
        ("mosaic/JointTarget@1", {"names": ["a", "b"], "positions": [1.0]}, "positions has 1 values for 2 names"),
        ("mosaic/JointTarget@1", {"names": ["a", "a"], "positions": [1.0, 1.0]}, "names has 'a' twice"),
        ("mosaic/JointTarget@1", {"names": ["a"], "positions": ["1"]}, "positions.0"),
        ("mosaic/GripperTarget@1", {"position": float("nan")}, "position"),
        ("mosaic/GripperTarget@1", {"position": -0.1}, "position"),
        ("mosaic/OccupancyGrid@1", GRID | {"width": 0, "data": []}, "width"),
        ("mosaic/OccupancyGrid@1", GRID | {"height": 0, "data": []}, "height"),
        ("mosaic/OccupancyGrid@1", GRID | {"data": [0]}, "data has 1 cells for a width of 2 and a height of 2"),
        ("mosaic/OccupancyGrid@1", GRID | {"data": [0, 0, 0, 101]}, "data.3"),
        ("mosaic/Pose@1", {"position": {"x": 1.0}}, "position.y"),
        ("mosaic/Pose@1", {"position": HERE, "orientation": {"w": 0.5}}, "orientation"),
        ("mosaic/Pose@1", {"position": HERE, "orientation": {"w": 0.5}}, "the length 1, this one 0.5"),
        ("mosaic/GpsFix@1", {"latitude": 91.0, "longitude": 0.0, "altitude": None}, "latitude"),
        ("mosaic/GpsFix@1", {"latitude": 9.0, "longitude": None, "altitude": None}, "both known, or neither"),
        ("mosaic/BatteryState@1", {"percent": 101.0}, "percent"),
        ("mosaic/Log@1", {"message": "x" * 5000}, "message"),
        ("mosaic/Log@1", {"message": "x", "level": "loud"}, "level"),
        ("mosaic/ImageAnnotations@1", {"boxes": [{"x": 0, "y": 0, "width": -1, "height": 1}]}, "boxes.0.width"),
    ],
)
def test_a_mistake_names_its_field(schema_id: str, wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        STANDARD_MESSAGES[schema_id].model_validate(wrong)


@pytest.mark.parametrize("rays", [10, 11, 12])
def test_a_driver_may_round_its_last_angle(rays: int) -> None:
    scan = STANDARD_MESSAGES["mosaic/LaserScan@1"].model_validate(SCAN | {"ranges": [1.0] * rays})
    assert len(scan.model_dump()["ranges"]) == rays


def test_a_message_with_more_fields_keeps_its_id_and_is_read_by_who_knows_less() -> None:
    class Fuller(BatteryState):
        cells: int = 6

    assert Fuller.schema_id == "mosaic/BatteryState@1"
    sent = Fuller(percent=50.0).model_dump(mode="json")
    assert STANDARD_MESSAGES[Fuller.schema_id].model_validate(sent).model_dump(mode="json") == {"percent": 50.0}
