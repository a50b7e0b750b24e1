"""What code of the pages imports and tests do without."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


@dataclass
class Ros:
    """Stands in for ROS 2 where a page's connector speaks to it: keeps what is published, and says what a test says."""

    published: list[tuple[str, Any]] = field(default_factory=list)
    subscribed: dict[str, Callable[[Any], None]] = field(default_factory=dict)
    open_nodes: int = 0

    def create_node(self, name: str, *, context: Any) -> Any:
        self.open_nodes += 1
        return SimpleNamespace(
            context=context,
            create_publisher=lambda kind, topic, depth: SimpleNamespace(
                publish=lambda message: self.published.append((topic, message))
            ),
            create_subscription=lambda kind, topic, heard, depth: self.subscribed.update({topic: heard}),
            destroy_node=self._closed,
        )

    def _closed(self) -> None:
        self.open_nodes -= 1


class RosExecutor:
    """One whose turn brings what there is."""

    said: dict[str, Any]
    ros: Ros

    def __init__(self, *, context: Any) -> None: ...

    def add_node(self, node: Any) -> None: ...

    def spin_once(self, *, timeout_sec: float) -> None:
        for topic, heard in self.ros.subscribed.items():
            heard(self.said[topic])

    def shutdown(self) -> None: ...


class RosTwist:
    """`geometry_msgs/msg/Twist`: zeros until somebody says otherwise."""

    def __init__(self) -> None:
        self.linear, self.angular = (SimpleNamespace(x=0.0, y=0.0, z=0.0) for _ in range(2))


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch) -> Ros:
    """`rclpy` and its messages, while the test runs."""
    found = Ros()
    RosExecutor.ros, RosExecutor.said = found, {}
    names: dict[str, dict[str, Any]] = {
        "rclpy": {"Context": object, "init": lambda context: None, "create_node": found.create_node},
        "rclpy.executors": {"SingleThreadedExecutor": RosExecutor},
        "geometry_msgs.msg": {"Twist": RosTwist},
        "sensor_msgs.msg": {"BatteryState": object},
    }
    for name, members in names.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    return found
