"""The whole safety drill on what moves a node of ROS: over real DDS, with a node that listens."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from support.devices.ros_side import RosNode
from support.live_drill import assert_safe, drilled

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
    last = heard.take()[-1]
    twist = last.twist if type_name == TWIST_STAMPED else last
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0, 0, 0)


async def test_an_arm_that_tells_where_it_is_passes_the_whole_drill(node: RosNode, here: dict[str, Any]) -> None:
    heard = node.subscription("/arm/joint_trajectory", TRAJECTORY)
    states = node.publisher("/joint_states", "sensor_msgs/msg/JointState")
    params = {**here, "topic": "/arm/joint_trajectory", "type": TRAJECTORY, "joints": ["shoulder", "elbow"]}
    reach = {"min": -1.5, "max": 1.5, "max_rate_per_s": 1.0}
    limits = {"shoulder": reach, "elbow": reach}
    safety = {"timeout_s": 0.5, "max_rate_hz": 40, "limits": limits}
    with repeated(lambda: states.write({"name": ["shoulder", "elbow"], "position": [0.4, -0.3]})):
        assert_safe(await drilled(connector(Ros2PublisherConfigurer, params=params, safety=safety)))
    (held,) = heard.take()[-1].points
    assert held.positions.tolist() == pytest.approx([0.4, -0.3])


async def test_numbers_of_any_message_pass_the_whole_drill(node: RosNode, here: dict[str, Any]) -> None:
    heard = node.subscription("/winch", "std_msgs/msg/Float32")
    params = {**here, "topic": "/winch", "type": "std_msgs/msg/Float32", "motion_fields": ["data"]}
    safety = {"timeout_s": 0.5, "max_rate_hz": 40, "limits": {"data": {"min": -0.2, "max": 0.2}}}
    assert_safe(await drilled(connector(Ros2PublisherConfigurer, params=params, safety=safety)))
    assert heard.take()[-1].data == 0
