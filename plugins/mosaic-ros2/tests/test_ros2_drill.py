"""The whole safety drill on what moves a node of ROS: over real DDS, with a node that listens."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from support.devices.ros_side import RosNode, RosReader
from support.live_drill import assert_safe, drilled
from support.waiting import wait_for

from mosaic_core.testing import connector
from mosaic_ros2.connectors.publisher import (
    OriginalTwistConfigurer,
    OriginalTwistStampedConfigurer,
    Ros2PublisherConfigurer,
)

TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
SPEEDS = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "timeout_s": 0.5, "max_rate_hz": 40}


@contextmanager
def repeated(write: Callable[[], None]) -> Iterator[None]:
    over = threading.Event()

    def run() -> None:
        while not over.wait(0.05):
            write()

    thread = threading.Thread(target=run, name="joint-states")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def expect_last(heard: RosReader, is_expected: Callable[[Any], bool]) -> None:
    """What the connector said last may still be under way when the drill has ended."""
    told: list[Any] = []

    def is_heard() -> bool:
        told[:] = heard.take(0.1) or told
        return bool(told) and is_expected(told[-1])

    wait_for(is_heard, "the last words on the topic")


@pytest.mark.parametrize(
    ("configurer", "named", "type_name"),
    [
        (Ros2PublisherConfigurer, {"topic": "/cmd_vel", "type": TWIST}, TWIST),
        (OriginalTwistConfigurer, {"topic_name": "/cmd_vel"}, TWIST),
        (OriginalTwistStampedConfigurer, {"topic_name": "/cmd_vel"}, TWIST_STAMPED),
    ],
)
async def test_a_base_that_listens_passes_the_whole_drill(
    node: RosNode, here: dict[str, Any], configurer: Any, named: dict[str, Any], type_name: str
) -> None:
    heard = node.subscription("/cmd_vel", type_name)
    assert_safe(await drilled(connector(configurer, params={**here, **named}, safety=SPEEDS)))

    def stands(told: Any) -> bool:
        twist = told.twist if type_name == TWIST_STAMPED else told
        return (twist.linear.x, twist.linear.y, twist.angular.z) == (0, 0, 0)

    expect_last(heard, stands)


async def test_an_arm_that_tells_where_it_is_passes_the_whole_drill(node: RosNode, here: dict[str, Any]) -> None:
    heard = node.subscription("/arm/joint_trajectory", TRAJECTORY)
    states = node.publisher("/joint_states", "sensor_msgs/msg/JointState")
    params = {**here, "topic": "/arm/joint_trajectory", "type": TRAJECTORY, "joints": ["shoulder", "elbow"]}
    reach = {"min": -1.5, "max": 1.5, "max_rate_per_s": 1.0}
    limits = {"shoulder": reach, "elbow": reach}
    safety = {"timeout_s": 0.5, "max_rate_hz": 40, "limits": limits}
    with repeated(lambda: states.write({"name": ["shoulder", "elbow"], "position": [0.4, -0.3]})):
        assert_safe(await drilled(connector(Ros2PublisherConfigurer, params=params, safety=safety)))
    held = [pytest.approx([0.4, -0.3])]
    expect_last(heard, lambda told: [point.positions.tolist() for point in told.points] == held)


async def test_numbers_of_any_message_pass_the_whole_drill(node: RosNode, here: dict[str, Any]) -> None:
    heard = node.subscription("/winch", "std_msgs/msg/Float32")
    params = {**here, "topic": "/winch", "type": "std_msgs/msg/Float32", "motion_fields": ["data"]}
    safety = {"timeout_s": 0.5, "max_rate_hz": 40, "limits": {"data": {"min": -0.2, "max": 0.2}}}
    assert_safe(await drilled(connector(Ros2PublisherConfigurer, params=params, safety=safety)))
    expect_last(heard, lambda told: told.data == 0)
