"""Names on the wire, the configuration of DDS, types that peers compare, and a middleware that is not there."""

from __future__ import annotations

import builtins
import time
import xml.etree.ElementTree as ElementTree
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.ros_side import STORE, RosNode, bytes_type, dds_name_of

from mosaic_core import DeviceGone
from mosaic_core.testing import build, collect
from mosaic_ros2.bus.bus import BusError
from mosaic_ros2.bus.dds.dds_bus import DdsBus
from mosaic_ros2.bus.dds.network import configuration, why_not_joined
from mosaic_ros2.bus.dds.wire_types import WireTypes, definitions_of
from mosaic_ros2.bus.ros_names import is_hidden, read_dds_topic, reply_topic_of, request_topic_of, ros_name, topic_of
from mosaic_ros2.bus.shared_bus import BusChoice, SharedBus
from mosaic_ros2.connectors.params import own_distribution, own_domain
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from mosaic_ros2.definitions.bundled import bundled
from mosaic_ros2.definitions.definition import Definition, DefinitionError, Field, FieldType
from mosaic_ros2.definitions.type_book import TypeBook

NAMES = st.from_regex(r"/[A-Za-z_][A-Za-z0-9_]{0,8}(/[A-Za-z_][A-Za-z0-9_]{0,8}){0,3}", fullmatch=True)


@given(NAMES)
def test_names_are_read_back_from_the_wire(name: str) -> None:
    assert read_dds_topic(topic_of(name)) == ("topic", name)
    assert read_dds_topic(request_topic_of(name)) == ("request", name)
    assert read_dds_topic(reply_topic_of(name)) == ("reply", name)
    assert ros_name(name[1:]) == ros_name(f" {name} ") == name


def test_topics_of_others_and_what_ros_keeps_to_itself_are_told_apart() -> None:
    assert read_dds_topic("ros_discovery_info") is None
    assert is_hidden("/count/_action/feedback")
    assert is_hidden("/rosout")
    assert not is_hidden("/scan")


def test_an_interface_that_is_not_there_is_told_with_those_that_are() -> None:
    with pytest.raises(BusError, match=r"no network interface 'llo'; did you mean 'lo'\?; there are: .*\blo\b"):
        DdsBus(231, TypeBook(shares=()), "llo").endpoints()


@pytest.mark.parametrize("interface", ["", "lo", "localhost", "10.9.9.9", "fe80::1"])
def test_what_else_keeps_dds_from_beginning_is_told_as_it_says_it(interface: str) -> None:
    what, cure = why_not_joined(interface, ["lo"], "no memory")
    assert (what, "CYCLONEDDS_URI" in cure) == ("no memory", True)


@pytest.mark.parametrize(
    ("interface", "peers", "environment", "parts"),
    [
        ("lo", (), {}, ["name=\"lo\"", "<AllowMulticast>false", "127.0.0.1"]),
        ("192.168.1.5", (), {}, ["address=\"192.168.1.5\""]),
        ("", ("10.0.0.7",), {}, ["Address=\"10.0.0.7\""]),
        ("", (), {"ROS_LOCALHOST_ONLY": "1"}, ["name=\"lo\"", "<AllowMulticast>false"]),
        ("", (), {"ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"}, ["name=\"lo\""]),
        ("", (), {"ROS_STATIC_PEERS": "robot;10.0.0.9"}, ["robot", "10.0.0.9"]),
        ("eth0", (), {"CYCLONEDDS_URI": "file:///etc/dds.xml"}, ["file:///etc/dds.xml,", "eth0"]),
    ],
)  # fmt: skip
def test_cyclone_is_told_what_is_asked_for(
    interface: str, peers: tuple[str, ...], environment: dict[str, str], parts: list[str]
) -> None:
    text = configuration(interface, peers, environment)
    assert [part for part in parts if part not in text] == []
    assert ElementTree.fromstring(text[text.index("<") :]).tag == "CycloneDDS"


def test_without_wishes_cyclone_chooses_the_network_itself() -> None:
    (domain,) = ElementTree.fromstring(configuration("", (), {}))
    assert [part.tag for part in domain] == ["Compatibility"]


def test_what_is_told_can_not_leave_its_place_in_the_configuration() -> None:
    text = configuration('lo"/><x y="', ('a"/><Evil/>',), {})
    found = ElementTree.fromstring(text)
    assert not list(found.iter("Evil"))


def test_types_on_the_wire_are_those_that_rosbags_knows() -> None:
    wire = WireTypes(TypeBook(shares=()))
    for name in bundled():
        if name in STORE.fielddefs and "/msg/" in name:
            ours, theirs = wire.of(name), bytes_type(name, dds_name_of(name))
            assert ours.__idl__.get_type_id().serialize() == theirs.__idl__.get_type_id().serialize(), name


def test_a_type_that_is_discovered_has_the_fields_of_its_definition() -> None:
    book = TypeBook(shares=())
    for found in definitions_of(WireTypes(book).of("diagnostic_msgs/msg/DiagnosticArray")):
        own = book.find(found.name)
        kinds = [str(one.type).replace("byte", "uint8") for one in own.fields]
        assert [one.name for one in found.fields] == [one.name for one in own.fields]
        assert [str(one.type) for one in found.fields] == kinds


def test_an_interface_that_is_named_twice_is_no_failure(domain: int, caplog: pytest.LogCaptureFixture) -> None:
    bus = DdsBus(domain % 230 + 2, TypeBook(shares=()), "lo")
    assert bus.endpoints() == []
    assert "which win" in caplog.text
    bus.close()


def test_text_of_wide_characters_is_refused_over_dds() -> None:
    book = TypeBook(shares=())
    book.add(Definition("acme/msg/Wide", (Field("text", FieldType("wstring")),)))
    with pytest.raises(DefinitionError, match="wstring"):
        WireTypes(book).of("acme/msg/Wide")


def test_a_publisher_of_another_distribution_is_told_with_the_cure(node: RosNode, here: dict[str, Any]) -> None:
    kept = node.publisher("/range", "sensor_msgs/msg/Range")
    params = {**here, "topic": "/range", "type": "sensor_msgs/msg/Range", "distribution": "humble", "silence_s": 0.3}
    handler = build(Ros2TopicConfigurer, params=params)
    handler.monotonic_s = time.monotonic  # type: ignore[method-assign]
    with pytest.raises(DeviceGone, match="write the `distribution`"):
        collect(handler, 1)
    assert kept.readers == 0


def test_a_machine_without_cyclone_is_told_about_zenoh(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def importing(name: str, *arguments: Any, **named: Any) -> Any:
        if name.startswith("mosaic_ros2.bus.dds"):
            raise ImportError("no module named cyclonedds")
        return real(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", importing)
    with pytest.raises(BusError, match="transport: zenoh"):
        SharedBus(BusChoice()).joined()


def test_the_shell_tells_domain_and_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    for text, domain in (("", 0), ("42", 42), ("999", 0), ("x", 0)):
        monkeypatch.setenv("ROS_DOMAIN_ID", text)
        assert own_domain() == domain
    for text, distribution in (("humble", "humble"), ("rolling", "kilted"), ("", "kilted")):
        monkeypatch.setenv("ROS_DISTRO", text)
        assert own_distribution() == distribution
