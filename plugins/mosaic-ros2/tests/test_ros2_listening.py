"""A topic's publishers come, vanish for long and return, send floods and nonsense, and offer too little."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import pytest
from support.devices.memory_bus import MemoryBus, SharedMemoryBus
from support.devices.ros_side import encoded

from mosaic_core import DeviceGone
from mosaic_core.testing import FakeClock, FakeHost, fake_host
from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.qos import LATCHED, RELIABLE, SENSOR, QosProfile, fitting, misfits
from mosaic_ros2.connectors.topic import Ros2TopicParams, RosTopic, topic_class
from mosaic_ros2.conversion.conversions import CONVERSIONS

TEMPERATURE = "sensor_msgs/msg/Temperature"
PUBLISHER = HeardEndpoint("/heat", TEMPERATURE, "publisher", SENSOR)


def heat(celsius: float) -> bytes:
    return encoded(TEMPERATURE, {"temperature": celsius})


@pytest.fixture
def bus() -> MemoryBus:
    return MemoryBus(FakeClock())


def topic(bus: MemoryBus, name: str = "/heat", type_name: str = TEMPERATURE, **params: Any) -> RosTopic[Any]:
    conversion = CONVERSIONS.get(type_name)
    checked = Ros2TopicParams(topic=name, type=type_name or None, **params)
    made = topic_class(conversion.message if conversion else None, conversion)
    handler = made("heat", checked, SharedMemoryBus(bus))
    handler.bind(FakeHost(bus.clock))
    return handler


def values(messages: Iterator[Any], count: int) -> list[float]:
    return [one.temperature_c for one in islice(messages, count)]


def test_a_publisher_that_vanishes_for_30_s_and_returns_is_heard_again(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    handler = topic(bus)
    messages = handler.messages()
    bus.at(0.5, lambda: bus.send(heat(20)))
    assert values(messages, 1) == [20]
    bus.at(1.0, bus.heard.clear)
    with pytest.raises(DeviceGone, match="nothing of ROS is heard"):
        next(messages)
    gone_s = bus.clock.now_s
    bus.at(30.0, lambda: bus.heard.append(PUBLISHER))
    for later_s in range(31, 60):
        bus.at(later_s, lambda: bus.send(heat(21)))
    found: list[float] = []
    while not found:  # as the runner does: another try every few seconds
        try:
            found = values(handler.messages(), 1)
        except DeviceGone:
            bus.clock.advance(3.0)
    assert found == [21]
    assert 31 <= bus.clock.now_s - gone_s <= 39


def test_a_topic_that_is_quiet_while_its_publisher_is_there_is_no_failure(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    bus.at(3600.0, lambda: bus.send(heat(5)))
    assert values(topic(bus).messages(), 1) == [5]


def test_of_a_flood_the_newest_goes_out_at_the_rate_and_the_rest_is_counted(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    handler = topic(bus, max_rate_hz=10)
    for number in range(1000):
        bus.at(0.1 + number * 0.001, lambda number=number: bus.send(heat(number)))  # type: ignore[misc]
    messages = handler.messages()
    found = values(messages, 11)
    assert found[-1] == 999
    assert fake_host(handler).losses["thinned"] > 100


def test_nonsense_is_counted_and_the_next_message_comes(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    handler = topic(bus, max_rate_hz=1000)
    for number, data in enumerate(
        (b"", b"\0\1\0\0", b"nonsense", heat(20)[:-3], heat(float("nan")), heat(-300), heat(1))
    ):
        bus.at(0.1 + number, lambda data=data: bus.send(data))  # type: ignore[misc]
    assert [handler.send(message) for message in islice(handler.messages(), 2)] == [False, True]
    assert fake_host(handler).losses["refused"] == 6


def test_a_message_that_is_larger_than_allowed_is_refused(bus: MemoryBus) -> None:
    bus.heard.append(replace(PUBLISHER, type="std_msgs/msg/String"))
    handler = topic(bus, type_name="std_msgs/msg/String", max_bytes=100)
    bus.at(0.1, lambda: bus.send(encoded("std_msgs/msg/String", {"data": "x" * 200})))
    bus.at(0.5, lambda: bus.send(encoded("std_msgs/msg/String", {"data": "short"})))
    assert next(handler.messages()) == {"data": "short"}
    assert fake_host(handler).losses["refused"] == 1


def test_a_name_that_nobody_publishes_is_told_with_the_nearest(bus: MemoryBus) -> None:
    bus.heard += [PUBLISHER, replace(PUBLISHER, name="/other")]
    with pytest.raises(DeviceGone, match=r"nobody publishes /haet on a bus in memory; did you mean '/heat'\?"):
        next(topic(bus, "/haet").messages())


def test_nothing_but_subscriptions_is_told(bus: MemoryBus) -> None:
    bus.heard.append(replace(PUBLISHER, role="subscription"))
    with pytest.raises(DeviceGone, match="no topic of theirs"):
        next(topic(bus).messages())


def test_another_type_is_told_with_what_to_write(bus: MemoryBus) -> None:
    bus.heard.append(replace(PUBLISHER, type="std_msgs/msg/Float32"))
    with pytest.raises(DeviceGone, match="write `type: std_msgs/msg/Float32`"):
        next(topic(bus).messages())


def test_a_type_of_other_fields_is_told_with_the_distribution(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    handler = topic(bus)
    messages = handler.messages()
    bus.at(0.1, lambda: bus.send(heat(1)))
    assert next(messages)
    subscription = bus.subscriptions[0]
    subscription.qos = LATCHED  # it does not match any more, though it is heard
    with pytest.raises(DeviceGone, match="write the `distribution`"):
        next(messages)


def test_without_a_type_whatever_is_heard_becomes_json(bus: MemoryBus) -> None:
    bus.heard.append(replace(PUBLISHER, type="std_msgs/msg/Bool"))
    handler = topic(bus, type_name="")
    bus.at(0.1, lambda: bus.send(encoded("std_msgs/msg/Bool", {"data": True})))
    assert next(handler.messages()) == {"data": True}


def test_what_is_asked_for_and_not_offered_is_told_with_the_cure(bus: MemoryBus) -> None:
    bus.heard.append(PUBLISHER)
    with pytest.raises(DeviceGone, match=r"best effort, and reliable is asked for.*write `qos: auto`"):
        next(topic(bus, qos="reliable").messages())


def test_a_publisher_that_offers_less_is_heard_once_it_came(bus: MemoryBus) -> None:
    bus.heard.append(replace(PUBLISHER, qos=RELIABLE))
    handler = topic(bus)
    messages = handler.messages()
    bus.at(0.1, lambda: bus.send(heat(1)))
    assert next(messages)
    assert bus.subscriptions[0].qos.is_reliable
    bus.at(1.0, lambda: bus.heard.append(PUBLISHER))
    bus.at(9.0, lambda: bus.send(heat(2)))
    assert next(messages)
    assert not bus.subscriptions[0].qos.is_reliable


def test_each_frame_is_thinned_by_itself(bus: MemoryBus) -> None:
    name = "tf2_msgs/msg/TFMessage"
    bus.heard.append(HeardEndpoint("/tf", name, "publisher", RELIABLE))
    handler = topic(bus, "/tf", name, max_rate_hz=1)
    frames = [{"header": {"frame_id": "map"}, "child_frame_id": child} for child in ("a", "b")]
    for number in range(4):
        bus.at(0.1 + 0.1 * number, lambda: bus.send(encoded(name, {"transforms": frames})))
    found = list(islice(handler.messages(), 4))
    assert [one.child_frame_id for one in found] == ["a", "b", "a", "b"]


def test_no_line_of_a_log_is_left_out(bus: MemoryBus) -> None:
    name = "rcl_interfaces/msg/Log"
    bus.heard.append(HeardEndpoint("/rosout", name, "publisher", RELIABLE))
    handler = topic(bus, "/rosout", name, max_rate_hz=1)
    bus.at(0.1, lambda: bus.send(*(encoded(name, {"msg": str(number)}) for number in range(9))))
    assert [one.message for one in islice(handler.messages(), 9)] == [str(number) for number in range(9)]


@pytest.mark.parametrize(
    ("offers", "wanted"),
    [
        ([], QosProfile(False, False, 5)),
        ([RELIABLE], QosProfile(True, False, 10)),
        ([RELIABLE, SENSOR], QosProfile(False, False, 5)),
        ([LATCHED], QosProfile(True, True, 1)),
        ([LATCHED, RELIABLE], QosProfile(True, False, 10)),
    ],
)
def test_auto_asks_for_what_every_publisher_offers(offers: list[QosProfile], wanted: QosProfile) -> None:
    asked = fitting(offers)
    assert asked == wanted
    assert not any(misfits(one, asked) for one in offers)


def test_deadlines_and_leases_fit_as_dds_says() -> None:
    asked = QosProfile(deadline_s=1.0, lease_s=2.0)
    assert len(misfits(QosProfile(), asked)) == 2
    assert misfits(QosProfile(deadline_s=0.5, lease_s=2.0), asked) == []
    assert "deadline 1 s" in str(asked)
