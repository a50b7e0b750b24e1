"""The connectors of an original ROS 2 robot's file, unchanged, and a node that really publishes over DDS: a page that
stands for an original dashboard, in a real Chromium, shows all of them and drives both velocity topics.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser
from support.devices.ros_side import LOOPBACK, RosNode, RosReader, qos
from support.original_page import connected_page
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]

DOMAIN = 1 + os.getpid() % 230
CONNECTORS = """\
  - type: "ros2-sender-sensor-Image"
    label: "camera"
    params:
      topic_name: "/camera/image_raw"
      recordable: "true"
  - type: "ros2-sender-sensor-PointCloud2"
    label: "lidar"
    params:
      topic_name: "/points"
      parallel_num: "3"
      stream_mode: "progressive"
      voxel_size: "0.5"
      min_points_to_subdivide: "10"
  - type: "ros2-sender-sensor-NavSatFix"
    label: "gps"
    params:
      topic_name: "/fix"
  - type: "ros2-sender-geometry-Pose"
    label: "pose"
    params:
      topic_name: "/pose"
  - type: "ros2-receiver-geometry-Twist"
    label: "cmd_vel"
    params:
      topic_name: "/cmd_vel"
  - type: "ros2-receiver-geometry-TwistStamped"
    label: "cmd_vel_stamped"
    params:
      topic_name: "/cmd_vel_stamped"
"""
"""As such files have it, every param as text."""
FIELDS = [{"name": name, "offset": 4 * at, "datatype": 7, "count": 1} for at, name in enumerate("xyz")]


@dataclass
class Wheels:
    """What the node is told to do."""

    plain: RosReader
    stamped: RosReader


@pytest.fixture
def wheels(monkeypatch: pytest.MonkeyPatch) -> Iterator[Wheels]:
    """A node that publishes everything ten times a second. Domain and network are those of the shell, as in ROS."""
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    node = RosNode(DOMAIN)
    images = node.publisher("/camera/image_raw", "sensor_msgs/msg/Image", qos(reliable=False))
    clouds = node.publisher("/points", "sensor_msgs/msg/PointCloud2", qos(reliable=False))
    fixes = node.publisher("/fix", "sensor_msgs/msg/NavSatFix")
    poses = node.publisher("/pose", "geometry_msgs/msg/Pose")
    pixels = np.full((240, 320, 3), (200, 60, 20), np.uint8).reshape(-1)
    points = np.random.default_rng(1).uniform(-5, 5, (2000, 3)).astype(np.float32)
    is_over = threading.Event()

    def speak() -> None:
        while not is_over.wait(0.1):
            images.write({"height": 240, "width": 320, "step": 960, "encoding": "rgb8", "data": pixels})
            size = {"height": 1, "width": len(points), "point_step": 12, "row_step": points.nbytes}
            clouds.write({**size, "fields": FIELDS, "data": points.reshape(-1).view(np.uint8)})
            fixes.write({"latitude": 37.5, "longitude": 127.0, "altitude": 30.0, "header": {"stamp": {"sec": 7}}})
            poses.write({"position": {"x": 1.5}, "orientation": {"w": 1.0}})

    speaker = threading.Thread(target=speak)
    speaker.start()
    yield Wheels(
        node.subscription("/cmd_vel", "geometry_msgs/msg/Twist"),
        node.subscription("/cmd_vel_stamped", "geometry_msgs/msg/TwistStamped"),
    )
    is_over.set()
    speaker.join()
    node.close()


def test_an_original_page_shows_and_drives_an_original_ros2_file(
    browser: Browser, server: Any, seed: Any, start_robot: Any, wheels: Wheels
) -> None:
    start_robot(CONNECTORS)
    errors: list[str] = []
    page = connected_page(browser, server, seed, errors)
    page.wait_for_function(
        "() => ['gps', 'pose'].every((label) => seen.messages[label]) && "
        "Object.keys(seen.messages).some((label) => label.startsWith('lidar-'))"
    )
    page.wait_for_function("() => document.querySelector('video').videoWidth === 320")
    fix, pose = page.evaluate("() => [JSON.parse(seen.messages.gps), seen.pose]")
    assert {"latitude": 37.5, "longitude": 127.0, "altitude": 30.0, "timestamp": 7_000_000}.items() <= fix.items()
    assert (pose["position"]["x"], pose["orientation"]["w"]) == (1.5, 1)
    assert pose["timestamp"] > 1_600_000_000_000_000
    page.evaluate("() => { seen.drives = true }")
    wait_for(lambda: any(one.linear.x == 0.2 for one in wheels.plain.take(0.1)), "the wheels turn")
    wait_for(lambda: any(one.twist.angular.z == 0.6 for one in wheels.stamped.take(0.1)), "those with a stamp, too")
    page.evaluate("() => { seen.drives = false }")
    wait_for(lambda: any(one.linear.x == 0 for one in wheels.plain.take(0.1)), "the wheels stand")
    wait_for(lambda: any(one.twist.angular.z == 0 for one in wheels.stamped.take(0.1)), "those with a stamp, too")
    stores = page.evaluate("() => seen.stores")
    assert stores["camera"] == "MediaStreamStore"
    assert stores["cmd_vel"] == stores["cmd_vel_stamped"] == "ThumbstickToTwistStore"
    assert errors == []
    page.context.close()
