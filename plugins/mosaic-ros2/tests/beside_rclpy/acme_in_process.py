"""Connectors in the process of a node of rclpy, run by a Python that has rclpy and of ours what ``OUR_PACKAGES`` holds:
prints what a connector heard of the node, and what the node heard of a connector."""

import asyncio
import json
import os
import site
import threading
import time

site.addsitedir(os.environ["OUR_PACKAGES"])

import rclpy
from geometry_msgs.msg import Twist
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from mosaic_core.testing import build, collect, connector, joined
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer

HERE = {"domain": int(os.environ["DOMAIN"]), "interface": "lo"}
rclpy.init()
node = rclpy.create_node("acme")
scans = node.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
scan = LaserScan(angle_min=-1.0, angle_max=1.0, angle_increment=1.0, range_max=8.0, ranges=[1.0, 2.0, 9.0])
node.create_timer(0.1, lambda: scans.publish(scan))
told: list[dict[str, float]] = []
node.create_subscription(
    Twist, "/cmd_vel", lambda heard: told.append({"x": heard.linear.x, "turn": heard.angular.z}), 10
)
threading.Thread(target=rclpy.spin, args=[node], daemon=True).start()


def heard() -> object:
    params = {**HERE, "topic": "/scan", "type": "sensor_msgs/msg/LaserScan", "silence_s": 20}
    handler = build(Ros2TopicConfigurer, params=params)
    handler.monotonic_s = time.monotonic
    return collect(handler, 1)[0].ranges


async def drive() -> None:
    params = {**HERE, "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    safety = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "requires_lease": False, "slow_down": "off"}
    async with joined(connector(Ros2PublisherConfigurer, label="drive", params=params, safety=safety)) as link:
        store = link.connection.sendable("drive")
        await store.wait_open()
        while not any(one["x"] for one in told):
            store.send_json({"linear": {"x": 0.5}, "angular": {"z": 0.25}})
            await asyncio.sleep(0.05)


ranges = heard()
asyncio.run(drive())
print(json.dumps({"heard": ranges, "told": next(one for one in told if one["x"])}), flush=True)
os._exit(0)
