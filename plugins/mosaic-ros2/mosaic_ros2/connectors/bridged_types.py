"""Finds which type of ROS a connector's messages become, by the standard message or the compact form that it sends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.data_tap import TappedChannel
from mosaic_core.messages import STANDARD_MESSAGES
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import MosaicError
from mosaic_ros2.conversion.compact import cloud_fields, scan_fields
from mosaic_ros2.conversion.conversions import CONVERSIONS, WHOLE, ToRos
from mosaic_sensors.laser_scan.udp import read_scan
from mosaic_sensors.point_cloud import decoded as decoded_cloud

DEPTH = 10
FRAMES_DEPTH = 100
"""Frames and parts of a robot, which come one by one, as tf2 has it."""


@dataclass(frozen=True, slots=True)
class BridgedType:
    """A type of ROS, and how a payload becomes one. ``frame_id``: what is meant where a message names none; empty: the
    sensor's own. ``is_whole``: whoever subscribes later needs the last one."""

    type_name: str
    read: Callable[[bytes], Any]
    fields: ToRos
    frame_id: str = ""
    is_whole: bool = False
    depth: int = DEPTH


def _standard_types() -> Mapping[str, BridgedType]:
    found = {}
    for name, one in CONVERSIONS.items():
        if one.fields is not None:
            is_whole = one.delivery is WHOLE
            depth = FRAMES_DEPTH if one.key is not None else 1 if is_whole else DEPTH
            read = one.message.model_validate_json
            found[name] = BridgedType(name, read, one.fields, one.frame_id, is_whole, depth)
    return found


STANDARD_TYPES = _standard_types()
"""Those that standard messages become, by the name of the type."""
_SCAN = BridgedType("sensor_msgs/msg/LaserScan", lambda data: read_scan(data, 0.0), scan_fields)
_COMPACT: Mapping[bytes, BridgedType] = {
    b"MLS1": _SCAN,
    b"MPC1": BridgedType("sensor_msgs/msg/PointCloud2", decoded_cloud, cloud_fields),
}
"""Those of the compact forms, by the letters with which they begin."""


def compact_type(payload: bytes) -> BridgedType:
    """The type of what connectors of scans and clouds send. Raises :class:`ValueError`."""
    kind = _SCAN if payload.startswith(b"{") else _COMPACT.get(payload[:4])
    if kind is None:
        raise ValueError(f"bytes that begin with {payload[:4]!r} are neither a scan nor a cloud in a compact form")
    return kind


def type_of(channel: TappedChannel, wanted: str | None) -> BridgedType | None:
    """What the channel's messages become; ``None``: its first one tells. Raises :class:`MosaicError`."""
    message = STANDARD_MESSAGES.get(channel.schema_id)
    if channel.data_type is MosaicDataType.BYTE_R2U and wanted is None:
        return None
    if channel.data_type is not MosaicDataType.JSON_R2U or message is None:
        known = ", ".join(one.__name__ for one in STANDARD_MESSAGES.values())
        cure = f"Scans and clouds go, without `type`, and standard messages: {known}."
        raise _mistake(f"'{channel.label}' ({channel.connector_type}) sends no standard message", cure)
    name = wanted or message.ros_type
    if CONVERSIONS[name].message is not message:
        fitting = ", ".join(one for one in STANDARD_TYPES if CONVERSIONS[one].message is message)
        raise _mistake(f"'{channel.label}' sends a {message.__name__}, which is no {name}", f"Write `type:` {fitting}.")
    return STANDARD_TYPES[name]


def _mistake(message: str, cure: str) -> MosaicError:
    return MosaicError(f"{message}. {cure}", code="config.invalid", cure=cure)
