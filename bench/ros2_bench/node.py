"""A node of ROS 2 that publishes pictures and clouds over DDS, from a process of its own. Pictures carry their number
and time as marks, and every message has the monotonic clock in its header."""

from __future__ import annotations

import time
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from mosaic_camera.marks import draw_marks
from mosaic_ros2.bus.dds.dds_bus import DdsBus
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.definitions.type_book import TypeBook

IMAGE, CLOUD = "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"
WIDTH, HEIGHT, FPS = 640, 480, 30
POINTS, CLOUDS_HZ = 100_000, 10
QOS = QosProfile(is_reliable=True, depth=2)


def header() -> dict[str, Any]:
    seconds, nanoseconds = divmod(time.monotonic_ns(), 1_000_000_000)
    return {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": "lidar"}


def publish(pipe: Connection, domain: int) -> None:
    """Publish until the pipe closes; answers each question with how many pictures and clouds were sent."""
    book = TypeBook()
    bus = DdsBus(domain, book, "lo")
    images, clouds = bus.publish("/image", IMAGE, QOS), bus.publish("/points", CLOUD, QOS)
    image, cloud = CdrEncoder(book, IMAGE), CdrEncoder(book, CLOUD)
    scene = np.random.default_rng(1).integers(0, 255, (HEIGHT // 16, WIDTH // 16, 3), np.uint8)
    picture = np.kron(scene, np.ones((16, 16, 1), np.uint8))
    angles = np.linspace(0, 40 * np.pi, POINTS, dtype=np.float32)
    points = np.stack([8 * np.cos(angles), 8 * np.sin(angles), angles / 40, angles % 1], axis=1).astype(np.float32)
    fields = [{"name": name, "offset": 4 * at, "datatype": 7, "count": 1} for at, name in enumerate("xyzi")]
    sent, began_s = [0, 0], time.monotonic()
    while True:
        now_s = time.monotonic()
        if now_s >= began_s + sent[0] / FPS:
            moved = np.roll(picture, sent[0] * 4, axis=1)
            draw_marks(moved, sent[0], time.monotonic())
            size = {"height": HEIGHT, "width": WIDTH, "step": 3 * WIDTH, "encoding": "bgr8"}
            images.write(image.encode({"header": header(), **size, "data": moved.reshape(-1)}))
            sent[0] += 1
        if now_s >= began_s + sent[1] / CLOUDS_HZ:
            size = {"height": 1, "width": POINTS, "point_step": 16, "row_step": points.nbytes}
            clouds.write(
                cloud.encode({"header": header(), **size, "fields": fields, "data": points.view(np.uint8).reshape(-1)})
            )
            sent[1] += 1
        try:
            if pipe.poll(0.001):
                pipe.recv()
                pipe.send(tuple(sent))
        except (EOFError, ConnectionResetError, BrokenPipeError):
            return
