"""Writes a robot's YAML file with a connector for each topic, service and action that is heard. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import yaml

from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.ros_names import is_hidden
from mosaic_ros2.bus.shared_bus import BusChoice
from mosaic_ros2.bus.silence import is_of_every_node
from mosaic_ros2.commands.hearing import actions_in

_HEAD = """\
# A MOSAIC robot, written by `mosaic ros2 init` from what it heard. Look through it: what an operator shall not see or
# command goes out. On its own: mosaic run FILE --serve 127.0.0.1:9002
version: 1
# To register it with a server, which says its robot_id and token (`mosaic server robot add NAME`):
# server:
#   ws_url: wss://mosaic.example.org
#   auth: { type: simple-token, robot_id: "${MOSAIC_ROBOT_ID}", params: { token: "${MOSAIC_TOKEN}" } }

connectors:
"""
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_CLOUD = "sensor_msgs/msg/PointCloud2"
_TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
_SIMPLE_SERVICES = ("std_srvs/srv/Trigger", "std_srvs/srv/SetBool", "std_srvs/srv/Empty")
MAX_CONNECTORS = 200


def robot_file(endpoints: Sequence[HeardEndpoint], choice: BusChoice) -> tuple[str, int]:
    """The text of the file, and how many connectors it has."""
    common = _common(choice)
    labels: set[str] = set()
    connectors = []
    for kind, params, more in _wanted(endpoints):
        name = params.get("topic") or params.get("service") or params.get("action") or kind
        label = _label(name, labels)
        connectors.append({"type": kind, "label": label, "params": {**params, **common}, **more})
        if len(connectors) == MAX_CONNECTORS:
            break
    lines = [yaml.safe_dump([one], default_flow_style=None, sort_keys=False, width=1000) for one in connectors]
    body = "".join("".join(f"  {line}\n" for line in text.splitlines()) for text in lines)
    return _HEAD + (body or "  []\n"), len(connectors)


def _common(choice: BusChoice) -> dict[str, Any]:
    """What every connector is told: the file runs in other shells too, so that the domain stands in it."""
    found: dict[str, Any] = {"domain": choice.domain}
    if choice.transport != "dds":
        found["transport"] = choice.transport
    if choice.interface:
        found["interface"] = choice.interface
    if choice.peers:
        found["peers"] = list(choice.peers)
    return found


def _wanted(endpoints: Sequence[HeardEndpoint]) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    published = sorted({(one.name, one.type) for one in endpoints if one.role == "publisher"})
    names = {name for name, _ in published}
    for name, kind in published:
        if is_hidden(name) and name != "/rosout":
            continue
        if kind in _IMAGES:
            if not _is_copy(name, names):
                yield "ros2-image", {"topic": name, "type": kind}, {}
        elif kind == _CLOUD:
            yield "ros2-point-cloud", {"topic": name, "max_points": 50_000}, {}
        elif not _is_copy(name, names) and kind not in _TWISTS:
            yield "ros2-topic", {"topic": name, "type": kind}, {}
    yield from _commands(endpoints)


def _is_copy(name: str, names: set[str]) -> bool:
    """image_transport publishes ``/image/compressed`` beside ``/image``."""
    base, _, ending = name.rpartition("/")
    return ending in ("compressed", "compressedDepth", "theora", "ffmpeg", "zstd") and base in names


def _commands(endpoints: Sequence[HeardEndpoint]) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    heard = sorted({(one.name, one.type) for one in endpoints if one.role == "subscription"})
    for name, kind in heard:
        if kind in _TWISTS:
            speeds = {"timeout_s": 0.5, "max_linear_mps": 0.3, "max_angular_radps": 0.5}
            yield "ros2-publisher", {"topic": name, "type": kind}, {"safety": speeds}
        elif kind == _TRAJECTORY:
            yield "ros2-publisher", {"topic": name, "type": kind}, {}
    actions = actions_in(endpoints)
    for name, server in sorted(actions.items()):
        if not server.is_foreign_service:
            yield "ros2-action", {"action": name, "type": server.type.removesuffix("_SendGoal")}, {}
    for one in endpoints:
        is_ours = one.role == "server" and not one.is_foreign_service and not is_hidden(one.name)
        if is_ours and one.type in _SIMPLE_SERVICES and not is_of_every_node(one):
            yield "ros2-service", {"service": one.name, "type": one.type, "requires_lease": True}, {}


def _label(name: str, taken: set[str]) -> str:
    base = re.sub(r"[^a-z0-9_]+", "_", name.strip("/").lower()).strip("_")[:56] or "ros"
    label, number = base, 2
    while label in taken:
        label, number = f"{base}_{number}", number + 1
    taken.add(label)
    return label
