"""A node of ROS 2 in a real Chromium: its camera, its scan, its battery, and its wheels."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser
from support.devices.ros_side import LOOPBACK, RosNode, RosReader, qos
from support.people import photographed, wait_connected
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]

DOMAIN = 1 + os.getpid() % 230
CONNECTORS = f"""
  - {{ type: ros2-image, label: front, params: {{ topic: /image, domain: {DOMAIN}, interface: lo }} }}
  - type: ros2-topic
    label: scan
    params: {{ topic: /scan, type: sensor_msgs/msg/LaserScan, domain: {DOMAIN}, interface: lo }}
  - type: ros2-topic
    label: battery
    params: {{ topic: /battery, type: sensor_msgs/msg/BatteryState, domain: {DOMAIN}, interface: lo }}
  - type: ros2-publisher
    label: cmd_vel
    params: {{ topic: /cmd_vel, type: geometry_msgs/msg/Twist, domain: {DOMAIN}, interface: lo }}
    safety: {{ max_linear_mps: 0.5, max_angular_radps: 1.0, slow_down: off }}
"""


@pytest.fixture
def wheels(monkeypatch: pytest.MonkeyPatch) -> Iterator[RosReader]:
    """A node that shows a picture, a scan and a battery ten times a second, and what it is told to do."""
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    node = RosNode(DOMAIN)
    heard = node.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    images = node.publisher("/image", "sensor_msgs/msg/Image", qos(reliable=False))
    scans = node.publisher("/scan", "sensor_msgs/msg/LaserScan", qos(reliable=False))
    batteries = node.publisher("/battery", "sensor_msgs/msg/BatteryState")
    pixels = np.full((240, 320, 3), (200, 60, 20), np.uint8).reshape(-1)
    around = {"angle_min": -3.0, "angle_max": 3.0, "angle_increment": 6.0 / 359, "range_max": 8.0}
    is_over = threading.Event()

    def speak() -> None:
        while not is_over.wait(0.1):
            images.write({"height": 240, "width": 320, "step": 960, "encoding": "rgb8", "data": pixels})
            scans.write({**around, "ranges": np.full(360, 2.0)})
            batteries.write({"percentage": 0.73, "voltage": 24.5, "current": -1.5, "power_supply_status": 2})

    speaker = threading.Thread(target=speak)
    speaker.start()
    yield heard
    is_over.set()
    speaker.join()
    node.close()


def test_a_node_is_seen_and_driven(
    browser: Browser, server: Any, seed: Any, sign_in: Any, start_robot: Any, wheels: RosReader
) -> None:
    start_robot(CONNECTORS, wait=False)
    page = browser.new_context(viewport={"width": 1300, "height": 900}).new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    page.wait_for_function("() => document.querySelector('video')?.videoWidth === 320")
    page.get_by_text("73").first.wait_for()
    page.get_by_role("button", name="Take control").click()
    page.keyboard.down("w")
    wait_for(lambda: any(0 < one.linear.x <= 0.5 for one in wheels.take(0.1)), "the wheels turn")
    page.keyboard.up("w")
    wait_for(lambda: any(one.linear.x == 0 for one in wheels.take(0.1)), "the wheels stand")
    photographed(page, "ros2")
    page.context.close()
