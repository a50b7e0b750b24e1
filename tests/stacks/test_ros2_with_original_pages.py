"""A robot of ROS 2 with the connectors of an original robot's file, and an original page that knows its documents
alone."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from independent.point_cloud import CloudStore
from support.devices.ros_side import LOOPBACK, RosNode, qos
from support.original_ros2_file import ORIGINAL_CONNECTORS

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(90)]

PAGE, ROBOT = "original page on aiortc", "our robot"
DOMAIN = 1 + (os.getpid() + 57) % 230
POINTS = np.random.default_rng(1).uniform(-5, 5, (500, 4)).astype(np.float32)
FIX = {"latitude": 37.5, "longitude": 127.0, "altitude": 30.0}
TWIST = {"linear": {"x": 0.2, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}}
FLOAT32 = 7


class Base(RosNode):
    """A base with a camera, a lidar and a receiver of positions, and what it was told."""

    def __init__(self) -> None:
        super().__init__(DOMAIN)
        sensor = qos(reliable=False)
        fields = [
            {"name": name, "offset": 4 * at, "datatype": FLOAT32, "count": 1}
            for at, name in enumerate(("x", "y", "z", "intensity"))
        ]
        cloud = {"height": 1, "width": len(POINTS), "point_step": 16, "row_step": 16 * len(POINTS), "is_dense": True}
        picture = {"height": 48, "width": 64, "step": 192, "encoding": "rgb8"}
        self._said = [
            (self.publisher("/camera/image_raw", "sensor_msgs/msg/Image", sensor),
             {**picture, "data": np.tile(np.uint8((10, 200, 30)), 64 * 48)}),
            (self.publisher("/points", "sensor_msgs/msg/PointCloud2", sensor),
             {**cloud, "fields": fields, "data": np.frombuffer(POINTS.tobytes(), np.uint8)}),
            (self.publisher("/fix", "sensor_msgs/msg/NavSatFix"), FIX),
            (self.publisher("/pose", "geometry_msgs/msg/Pose"), {"position": {"x": 1.5}, "orientation": {"w": 1.0}}),
            (self.publisher("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
             {"pose": {"pose": {"position": {"x": 2.5}}}}),
        ]  # fmt: skip
        self.twists = self.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
        self.stamped = self.subscription("/cmd_vel_stamped", "geometry_msgs/msg/TwistStamped")

    async def speak(self) -> None:
        """Ten times a second, until it is cancelled."""
        while True:
            for publisher, values in self._said:
                publisher.write(values)
            await asyncio.sleep(0.1)


@pytest.fixture(scope="module")
def base() -> Iterator[Base]:
    words = {"CYCLONEDDS_URI": LOOPBACK, "ROS_DOMAIN_ID": str(DOMAIN)}
    with pytest.MonkeyPatch.context() as patch:
        for name, word in words.items():
            patch.setenv(name, word)
        node = Base()
        yield node
        node.close()


@pytest.fixture(scope="module")
def robot(base: Base, start_robot: Any) -> Any:
    return start_robot(ORIGINAL_CONNECTORS)


async def test_an_original_page_sees_and_drives_a_robot_of_ros_2_by_an_original_file(
    pair: Any, page: Any, seed: Any, base: Base, robot: Any, until: Any
) -> None:
    pair(ROBOT, PAGE, "an original file with ROS 2: picture, clouds, positions and commands")

    speaking = asyncio.create_task(base.speak())
    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call_as_configured(seed.robot_id)
        assert call.streams == ["camera"]
        picture = (await asyncio.wait_for(call.tracks[0].recv(), 20)).to_ndarray(format="rgb24")
        assert np.abs(picture.reshape(-1, 3).mean(axis=0) - (10, 200, 30)).max() < 8
        await until(lambda: all(call.received[label] for label in ("gps", "pose", "amcl")), "positions")
        fix, pose, amcl = (call.objects(label)[-1] for label in ("gps", "pose", "amcl"))
        assert FIX.items() <= fix.items()
        assert (pose["position"]["x"], pose["orientation"]["w"], amcl["position"]["x"]) == (1.5, 1.0, 2.5)
        assert all(isinstance(one["timestamp"], int) for one in (fix, pose, amcl))
        await until(lambda: len(cloud_of(call, "lidar_main")) == len(POINTS), "the whole cloud")
        await until(lambda: len(cloud_of(call, "lidar")) > 0, "the cloud on several channels")
        plain: list[Any] = []
        stamped: list[Any] = []

        def drives() -> bool:
            for label in ("cmd_vel", "cmd_vel_stamped"):
                call.channels[label].send(json.dumps(TWIST))
            plain.extend(base.twists.take(0.0))
            stamped.extend(one.twist for one in base.stamped.take(0.0))
            return all(any(one.linear.x for one in heard) for heard in (plain, stamped))

        await until(drives, "it drives, by both commands")
        for one in (*plain, *stamped):
            assert 0 <= one.linear.x <= 0.2
            assert one.angular.z == pytest.approx(one.linear.x / 2)
        speaking.cancel()


def cloud_of(call: Any, label: str) -> Any:
    """The last whole cloud that the original page's store has gathered."""
    store = CloudStore()
    for name in sorted(call.received):
        if name.startswith(f"{label}-"):
            for message in call.received[name]:
                store.take(message)
    return store.clouds[-1] if store.clouds else ()
