"""Commands to topics: limits, silence, stops, an arm that is held, a bus that is away, and mistakes of the file."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

import pytest
from support.devices.absence import hasty as hasty_waits
from support.devices.absence import tries_in_thirty_seconds
from support.devices.memory_bus import MemoryBus, MemoryPublication, SharedMemoryBus
from support.devices.ros_side import RosNode, decoded, encoded

from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Refused
from mosaic_core.messages import JointTarget, Twist
from mosaic_core.testing import FakeClock, Leaves, LosesLease, Silence, Stopped, build, feed, until
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_ros2.bus import kept_publication
from mosaic_ros2.bus.bus import BusError, HeardEndpoint
from mosaic_ros2.bus.kept_publication import KeptPublication
from mosaic_ros2.bus.qos import LATCHED, RELIABLE, QosProfile
from mosaic_ros2.bus.silence import why_unheard
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.joint_watch import JointWatch
from mosaic_ros2.connectors.publisher import (
    OriginalTwistConfigurer,
    OriginalTwistStampedConfigurer,
    Ros2PublisherConfigurer,
)
from mosaic_ros2.connectors.publishing import TwistPublisher
from mosaic_ros2.connectors.trajectory import trajectory_publisher

TWIST = "geometry_msgs/msg/Twist"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
SPEEDS = {"max_linear_mps": 0.5, "max_angular_radps": 1.0}
FORWARD = {"linear": {"x": 0.3}}


class Rig:
    """A publisher on a bus in memory, and what was published."""

    def __init__(self, type_name: str, make: Any, qos: Any = RELIABLE) -> None:
        self.bus = MemoryBus(FakeClock())
        self.shared = SharedMemoryBus(self.bus)
        self.type_name = type_name
        self.publication = KeptPublication(self.shared, "/topic", type_name, qos)
        self.publication.__enter__()
        self.publication.wait_until_heard(5)
        self.handler = make(self.publication, CdrEncoder(self.shared.book, type_name))

    def published(self) -> list[Any]:
        return [decoded(self.type_name, one) for one in self.bus.published]

    def close(self) -> None:
        self.publication.__exit__(None, None, None)


@pytest.fixture
def base() -> Any:
    rig = Rig(TWIST, lambda *parts: TwistPublisher("drive", *parts))
    yield rig
    rig.close()


@pytest.mark.parametrize("what", [Silence(1.0), Stopped(), LosesLease(), Leaves()])
def test_a_base_stands_still_when_nobody_commands_it_any_more(base: Rig, what: Any) -> None:
    assert feed(base.handler, [FORWARD, what]).made_safe
    first, last = base.published()
    assert (first.linear.x, last.linear.x) == (0.3, 0.0)


def test_a_command_that_nobody_hears_is_refused_and_a_standstill_is_published_all_the_same(base: Rig) -> None:
    base.bus.readers = 0
    with pytest.raises(Refused, match="nobody subscribes to /topic"):
        base.handler.handle_data(Twist.planar(0.3))
    base.handler.make_safe("safety.stop")
    assert len(base.published()) == 1


def subscribed(name: str, type_name: str, qos: QosProfile = QosProfile()) -> HeardEndpoint:  # noqa: B008 - frozen
    return HeardEndpoint(name, type_name, "subscription", qos)


@pytest.mark.parametrize(
    ("endpoints", "what"),
    [
        ([], "nobody subscribes to /cmd_vel; start the node that shall take it"),
        (
            [subscribed("/cmd_veloc", TWIST)],
            "nobody subscribes to /cmd_vel; did you mean '/cmd_veloc'?; start the node",
        ),
        (
            [subscribed("/cmd_vel", TRAJECTORY)],
            f"/cmd_vel is taken as {TRAJECTORY}, not as {TWIST}; publish it as {TRAJECTORY}",
        ),
        (
            [subscribed("/cmd_vel", TWIST, RELIABLE)],
            "who subscribes to /cmd_vel does not hear it: it is best effort, and reliable is asked for; ask for less",
        ),
        ([HeardEndpoint("/cmd_vel", TRAJECTORY, "publisher")], "nobody subscribes to /cmd_vel; start the node"),
    ],
)
def test_who_does_not_hear_a_command_is_told_why(endpoints: list[HeardEndpoint], what: str) -> None:
    told = why_unheard("/cmd_vel", TWIST, QosProfile(is_reliable=False), endpoints)
    assert "; ".join(told).startswith(what)


def test_a_standstill_that_could_not_be_published_raises_so_that_it_is_tried_again(base: Rig) -> None:
    base.bus.fails = True
    with pytest.raises(Refused, match="the bus is away"):
        base.handler.handle_data(Twist.planar(0.3))
    with pytest.raises(Exception, match="the bus is away"):
        base.handler.make_safe("safety.stop")


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next attempt comes at once."""
    monkeypatch.setattr(kept_publication, "RETRY", hasty_waits(RETRY))
    monkeypatch.setattr(kept_publication, "OWED_S", 0.01)


@pytest.mark.usefixtures("hasty")
async def test_a_topic_that_is_lost_for_thirty_seconds_begins_with_a_standstill_once_somebody_hears(
    base: Rig, caplog: pytest.LogCaptureFixture
) -> None:
    base.handler.handle_data(Twist.planar(0.3))
    base.bus.fails = True
    with pytest.raises(Refused, match="the bus is away"):
        base.handler.handle_data(Twist.planar(0.4))
    for _ in range(2):  # as the safety thread does
        with pytest.raises(DeviceGone, match="/topic is not open: the bus is away"):
            base.handler.make_safe("safety.timeout")
        with pytest.raises(Refused, match="/topic is not open: the bus is away"):
            base.handler.handle_data(Twist.planar(0.4))
    often = base.bus.asked + tries_in_thirty_seconds(RETRY)
    await until(lambda: base.bus.asked >= often)
    base.bus.readers = 0
    base.bus.fails = False
    await until(lambda: base.bus.opened == 2)
    await until(lambda: base.handler.keeper.absence is None)
    assert len(base.published()) == 1
    base.bus.readers = 1
    await until(lambda: len(base.published()) == 2)
    base.handler.handle_data(Twist.planar(0.5))
    assert [one.linear.x for one in base.published()] == [0.3, 0.0, 0.5]
    assert [one.getMessage() for one in caplog.records if one.levelname == "WARNING"] == [
        "ros2 /topic: the bus is away; tries again at once"
    ]


@pytest.mark.usefixtures("hasty")
async def test_a_topic_that_does_not_even_end_in_order_is_opened_again(base: Rig) -> None:
    base.handler.handle_data(Twist.planar(0.3))
    base.bus.fails = base.bus.ends_badly = True
    with pytest.raises(Refused):
        base.handler.handle_data(Twist.planar(0.4))
    base.bus.fails = False
    await until(lambda: base.bus.opened == 2)
    base.bus.ends_badly = False


@pytest.mark.usefixtures("hasty")
async def test_a_command_after_a_loss_comes_behind_the_standstill(base: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_publication, "OWED_S", 60.0)
    base.handler.handle_data(Twist.planar(0.3))
    base.bus.fails = True
    with pytest.raises(DeviceGone):
        base.handler.make_safe("safety.timeout")
    base.bus.fails = False
    await until(lambda: base.publication.wait_until_heard(0.1))
    base.handler.handle_data(Twist.planar(0.5))
    assert [one.linear.x for one in base.published()] == [0.3, 0.0, 0.5]


def test_subscriptions_that_are_too_slow_cost_a_message_and_no_topic(base: Rig) -> None:
    base.bus.is_slow = True
    with pytest.raises(Refused, match="no room"):
        base.handler.handle_data(Twist.planar(0.3))
    base.bus.is_slow = False
    base.handler.handle_data(Twist.planar(0.4))
    assert ([one.linear.x for one in base.published()], base.bus.opened) == ([0.4], 1)


@pytest.mark.usefixtures("hasty")
async def test_whatever_a_middleware_raises_the_topic_is_opened_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    bus, errors = MemoryBus(FakeClock()), [OSError("no such interface"), KeyError("type")]
    publish = bus.publish

    def hesitant(topic: str, type_name: str, policies: QosProfile) -> MemoryPublication:
        if errors:
            raise errors.pop()
        return publish(topic, type_name, policies)

    monkeypatch.setattr(bus, "publish", hesitant)
    with KeptPublication(SharedMemoryBus(bus), "/topic", TWIST, RELIABLE) as publication:
        await until(lambda: publication.readers)


def test_a_robot_that_ends_publishes_a_standstill_last() -> None:
    rig = Rig(TWIST, lambda *parts: TwistPublisher("drive", *parts))
    rig.handler.handle_data(Twist.planar(0.3))
    rig.close()
    assert [one.linear.x for one in rig.published()] == [0.3, 0.0]


def test_a_robot_that_ends_without_a_command_says_nothing() -> None:
    rig = Rig(TWIST, lambda *parts: TwistPublisher("drive", *parts))
    rig.close()
    assert rig.published() == []


def test_a_bus_that_is_away_when_the_robot_starts_is_told_to_whoever_commands() -> None:
    bus = MemoryBus(FakeClock())
    bus.fails = True
    publication = KeptPublication(SharedMemoryBus(bus), "/topic", TWIST, RELIABLE)
    with publication, pytest.raises(Refused, match="/topic is not open"):
        publication.send(b"")


def test_a_latched_message_needs_nobody_who_hears_it_now() -> None:
    rig = Rig("std_msgs/msg/Bool", lambda publication, encoder: publication, LATCHED)
    rig.bus.readers = 0
    rig.publication.send(encoded("std_msgs/msg/Bool", {"data": True}))
    assert rig.published()[0].data
    rig.close()


def test_a_base_without_limits_is_a_mistake_of_the_file_and_so_is_one_that_holds_its_velocity() -> None:
    params = {"topic": "cmd_vel", "type": TWIST}
    with pytest.raises(ConfigError, match=r"max_linear_mps: 0\.5, max_angular_radps"):
        build(Ros2PublisherConfigurer, params=params)
    with pytest.raises(ConfigError, match="drives on for ever"):
        build(Ros2PublisherConfigurer, params=params, safety={**SPEEDS, "on_loss": "hold"})
    with pytest.raises(ConfigError, match="are for a Twist"):
        build(Ros2PublisherConfigurer, params={"topic": "a", "type": "std_msgs/Bool"}, safety=SPEEDS)
    with pytest.raises(ConfigError, match="write `safe_message`"):
        build(Ros2PublisherConfigurer, params={"topic": "a", "type": "std_msgs/Bool"}, safety={"timeout_s": 1})


def test_a_safe_message_with_a_mistake_is_told_before_the_robot_starts() -> None:
    params = {"topic": "lamp", "type": "std_msgs/Bool", "safe_message": {"dato": False}}
    with pytest.raises(ValueError, match="did you mean 'data'"):
        build(Ros2PublisherConfigurer, params=params)


def test_numbers_that_mean_motion_need_the_lease_and_are_zero_when_nobody_commands() -> None:
    params = {"topic": "speed", "type": "std_msgs/Float64", "motion_fields": ["data"]}
    handler = build(Ros2PublisherConfigurer, params=params)
    assert (handler.requires_lease, handler.timeout_s, handler.motion_fields) == (True, 0.5, ("data",))
    assert handler.safe_fields() == {}


def standard(type_name: str, **params: Any) -> Rig:
    """A publisher of a standard message as the configurer makes it, on a bus in memory."""

    def make(publication: Any, encoder: Any) -> Any:
        told = build(Ros2PublisherConfigurer, params={"topic": "/topic", "type": type_name, **params})
        return type(told)("topic", publication, encoder, None)

    return Rig(type_name, make)


def test_a_goal_of_an_operator_becomes_a_pose_of_ros_in_the_frame_that_is_meant() -> None:
    rig = standard("geometry_msgs/msg/PoseStamped")
    assert not rig.handler.requires_lease
    feed(rig.handler, [{"position": {"x": 1.5, "y": 2.0}}, {"position": {"x": 0, "y": 0}, "frame_id": "odom"}])
    first, second = rig.published()
    assert (first.pose.position.x, first.header.frame_id, second.header.frame_id) == (1.5, "map", "odom")
    assert first.header.stamp.sec > 1_600_000_000
    rig.close()


def test_a_gripper_takes_its_target_within_limits_and_from_the_holder_of_the_lease_alone() -> None:
    name = "control_msgs/msg/GripperCommand"
    rig = standard(name)
    assert (rig.handler.requires_lease, rig.handler.position_fields) == (True, ("position",))
    feed(rig.handler, [{"position": 0.04, "max_effort": 5.0}])
    (sent,) = rig.published()
    assert (sent.position, sent.max_effort) == (0.04, 5.0)
    rig.close()
    params = {"topic": "grip", "type": name}
    limits = {"limits": {"position": {"max": 0.08}}}
    assert feed(build(Ros2PublisherConfigurer, params=params, safety=limits), [{"position": -1}]).refused
    with pytest.raises(ConfigError, match="says itself what moves"):
        build(Ros2PublisherConfigurer, params={**params, "motion_fields": ["position"]})


@pytest.mark.parametrize("configurer", [OriginalTwistConfigurer, OriginalTwistStampedConfigurer])
def test_the_receivers_of_original_robots_have_limits_by_themselves(configurer: Any) -> None:
    handler = build(configurer, params={"topic_name": "cmd_vel"})
    fed = feed(handler, [{"linear": {"x": 5.0}}])
    assert fed.refused[0].code == "plugin.no_device"
    assert isinstance(handler, TwistPublisher)


class Arm(Rig):
    """A trajectory publisher whose joint states are what a test says."""

    def __init__(self, joints: tuple[str, ...] = ()) -> None:
        self.at: dict[str, float] = {}

        def make(publication: Any, encoder: Any) -> Any:
            watch = JointWatch(self.shared, "/joint_states")
            watch.positions = lambda: self.at  # type: ignore[method-assign]
            return trajectory_publisher(joints)("arm", publication, encoder, watch, 1.0)

        super().__init__(TRAJECTORY, make)


def test_an_arm_is_held_where_it_is_when_nobody_commands_it_any_more() -> None:
    arm = Arm()
    arm.at = {"a": 0.1, "b": 0.2, "c": 9.0}
    target = JointTarget(names=["a", "b"], positions=[1.0, 2.0]).model_dump(mode="json")
    assert feed(arm.handler, [target, Silence(1.0)]).made_safe
    sent, held = arm.published()
    assert sent.points[0].positions.tolist() == [1.0, 2.0]
    assert (held.joint_names, held.points[0].positions.tolist()) == (["a", "b"], [0.1, 0.2])
    arm.close()


def test_an_arm_whose_place_is_not_known_gets_a_trajectory_without_points() -> None:
    arm = Arm()
    feed(arm.handler, [JointTarget(names=["a"], positions=[1.0]).model_dump(mode="json"), Silence(1.0)])
    assert arm.published()[-1].points == []
    arm.close()


def test_joints_that_are_named_move_no_faster_than_their_limits_from_where_they_are() -> None:
    arm = Arm(("a", "b"))
    arm.at = {"a": 0.5, "b": 0.0}
    assert arm.handler.position_fields == ("a", "b")
    assert arm.handler.reported_position("a") == 0.5
    feed(arm.handler, [{"a": 1.0}])
    assert arm.published()[0].joint_names == ["a"]
    arm.close()


def test_joint_states_of_a_node_tell_where_an_arm_is(node: RosNode, here: dict[str, Any]) -> None:
    states = node.publisher("/joint_states", "sensor_msgs/msg/JointState")
    shared = Shared()
    params = {**here, "topic": "/arm", "type": TRAJECTORY, "joints": ["a"]}
    handler: Any = build(Ros2PublisherConfigurer, params=params, shared=shared)
    with shared.entered():
        until_s = time.monotonic() + 20
        while handler.reported_position("a") is None and time.monotonic() < until_s:
            states.write({"name": ["a"], "position": [0.75]})
            time.sleep(0.02)
        assert handler.reported_position("a") == 0.75


class Quiet:
    """A subscription to which nothing comes."""

    def take(self, wait_s: float) -> list[Any]:
        threading.Event().wait(wait_s)
        return []

    def close(self) -> None: ...


async def test_joints_that_can_not_be_watched_are_told_and_watched_once_they_can(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.INFO)
    bus, errors = MemoryBus(FakeClock()), [BusError("the bus is away")]

    def subscribe(*_: Any) -> Quiet:
        if errors:
            raise errors.pop()
        return Quiet()

    monkeypatch.setattr(bus, "subscribe", subscribe)
    with JointWatch(SharedMemoryBus(bus), "/joint_states"):
        await until(lambda: "ros2 /joint_states: the device is back" in caplog.messages)
    assert "can't watch /joint_states: the bus is away" in caplog.messages[0]
