"""Definitions: names, files, what is bundled, and what is said where something is not known."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from mosaic_core.testing import build
from mosaic_core.words.errors import ConfigError
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from mosaic_ros2.definitions.bundled import DISTRIBUTIONS, bundled
from mosaic_ros2.definitions.definition import (
    DefinitionError,
    FieldType,
    action_name,
    dds_name,
    full_name,
    service_name,
)
from mosaic_ros2.definitions.msg_text import field_type, read_action, read_message, read_service
from mosaic_ros2.definitions.type_book import TypeBook

GRIP = """
# how a gripper stands
uint8 OPEN=0
uint8 CLOSED = 1   # a constant
string<=8 name "left"
float64[3] force
Finger[<=5] fingers
std_msgs/Header header
int32[] counts [1, 2]
"""


@pytest.mark.parametrize(
    "name", ["sensor_msgs/Image", "sensor_msgs/msg/Image", "sensor_msgs::msg::dds_::Image_", " sensor_msgs/Image "]
)
def test_a_type_has_one_full_name(name: str) -> None:
    assert full_name(name) == "sensor_msgs/msg/Image"
    assert dds_name(name) == "sensor_msgs::msg::dds_::Image_"


@pytest.mark.parametrize(
    "name", ["", "Image", "sensor_msgs/", "a/b/c", "a/msg/b/c", "1/msg/X", "a b/msg/X", "acme/srv"]
)
def test_what_is_no_name_of_a_type_is_refused_with_an_example(name: str) -> None:
    with pytest.raises(DefinitionError, match="write it like sensor_msgs/msg/LaserScan"):
        full_name(name)


def test_a_service_and_an_action_have_names_of_their_kind() -> None:
    assert service_name("std_srvs/Trigger") == service_name("std_srvs/srv/Trigger") == "std_srvs/srv/Trigger"
    assert action_name("acme/Go") == "acme/action/Go"
    for wrong in (lambda: service_name("std_msgs/msg/Bool"), lambda: action_name("std_srvs/srv/Trigger")):
        with pytest.raises(DefinitionError, match="of another kind"):
            wrong()


def test_a_message_file_becomes_its_fields_without_constants_defaults_and_comments() -> None:
    found = read_message("acme/Grip", GRIP)
    assert [(one.name, str(one.type)) for one in found.fields] == [
        ("name", "string<=8"),
        ("force", "float64[3]"),
        ("fingers", "acme/msg/Finger[<=5]"),
        ("header", "std_msgs/msg/Header"),
        ("counts", "int32[]"),
    ]
    assert found.messages_in_it() == ("acme/msg/Finger", "std_msgs/msg/Header")


def test_a_message_without_fields_has_the_byte_that_ros_gives_it() -> None:
    assert read_message("acme/Nothing", "# empty").fields[0].type == FieldType("uint8")


@pytest.mark.parametrize(("text", "reason"), [("float64 x y=", None), ("oops", "line 1"), ("int8 a\nint8 a", "line 2")])
def test_a_line_that_is_no_field_is_named(text: str, reason: str | None) -> None:
    if reason is None:
        assert read_message("acme/X", text).fields[0].name == "x"
    else:
        with pytest.raises(DefinitionError, match=reason):
            read_message("acme/X", text)


def test_a_type_as_long_as_no_memory_is_refused() -> None:
    with pytest.raises(DefinitionError, match="longer than"):
        field_type("uint8[99999999999]", "acme")


def test_a_service_and_an_action_become_the_messages_that_ros_sends() -> None:
    request, response = read_service("acme/srv/Ask", "string what\n---\nbool done")
    assert (request.name, response.name) == ("acme/srv/Ask_Request", "acme/srv/Ask_Response")
    goal, *others = read_action("acme/action/Go", "float32 x\n---\nbool there\n---\nfloat32 left")
    assert goal.name == "acme/action/Go_Goal"
    send = next(one for one in others if one.name.endswith("SendGoal_Request"))
    assert [str(one.type) for one in send.fields] == ["unique_identifier_msgs/msg/UUID", "acme/action/Go_Goal"]
    with pytest.raises(DefinitionError, match="3 are expected"):
        read_action("acme/action/Go", "float32 x\n---\n")


def test_every_bundled_definition_is_complete() -> None:
    book = TypeBook(shares=())
    assert len(bundled()) > 180
    for name in bundled():
        assert book.closure(name)


def test_a_message_has_the_form_of_its_distribution() -> None:
    names = {one: [field.name for field in bundled(one)["sensor_msgs/msg/Range"].fields] for one in DISTRIBUTIONS}
    assert "variance" not in names["humble"]
    assert all("variance" in names[one] for one in ("iron", "jazzy", "kilted"))
    assert bundled("rolling")["sensor_msgs/msg/Range"] == bundled("kilted")["sensor_msgs/msg/Range"]


def test_files_and_packages_that_are_named_win_over_what_is_bundled(tmp_path: Path) -> None:
    folder = tmp_path / "acme" / "msg"
    folder.mkdir(parents=True)
    (folder / "Grip.msg").write_text("float32 width")
    (tmp_path / "std_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "std_msgs" / "msg" / "Bool.msg").write_text("bool data\nbool sure")
    for place in (tmp_path, tmp_path / "acme", folder / "Grip.msg"):
        assert TypeBook([place], shares=()).find("acme/Grip").fields[0].name == "width"
    assert len(TypeBook([tmp_path], shares=()).find("std_msgs/Bool").fields) == 2
    assert len(TypeBook(shares=[tmp_path]).find("std_msgs/Bool").fields) == 1
    assert TypeBook(shares=[tmp_path]).knows("acme/Grip")


def test_a_type_that_nobody_defined_is_told_with_the_nearest_name_and_the_cure() -> None:
    with pytest.raises(DefinitionError, match=r"did you mean 'sensor_msgs/msg/LaserScan'\?.*`definitions`"):
        TypeBook(shares=()).find("sensor_msgs/LaserScn")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (
            "std_srvs/srv/SetBol_Request",
            r"defined std_srvs/srv/SetBol; did .* 'std_srvs/srv/SetBool'\?.* \.srv file",
        ),
        ("nav2_msgs/action/Navigate_Goal", r"defined nav2_msgs/action/Navigate[;.].* \.action file"),
    ],
)
def test_a_service_or_action_that_nobody_defined_is_named_as_people_write_it(asked: str, said: str) -> None:
    with pytest.raises(DefinitionError, match=said):
        TypeBook(shares=()).find(asked)


def test_a_message_that_contains_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "acme" / "msg").mkdir(parents=True)
    (tmp_path / "acme" / "msg" / "Tree.msg").write_text("Tree[] children")
    with pytest.raises(DefinitionError, match="contains itself"):
        TypeBook([tmp_path], shares=()).closure("acme/Tree")


@pytest.mark.parametrize(
    ("kind", "refused"),
    [("nav_msgs/msg/Odometri", True), ("acme_msgs/msg/Odometri", False), ("nav_msgs/msg/Tides", False)],
)
def test_a_slip_in_a_bundled_package_is_refused_before_the_robot_starts(kind: str, refused: bool) -> None:
    make = partial(build, Ros2TopicConfigurer, params={"topic": "/odom", "type": kind})
    if refused:
        with pytest.raises(ConfigError, match="did you mean 'nav_msgs/msg/Odometry'"):
            make()
    else:
        assert make().label == "under_test", "its publisher may tell it"
