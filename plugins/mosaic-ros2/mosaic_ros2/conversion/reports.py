"""Converts what is told in words, both ways: log lines and diagnostics."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

from mosaic_core.messages import Diagnostic, Log
from mosaic_ros2.conversion.parts import MAX_NAME, Origin, Ros, ros_header, ros_stamp, stamp_us

MAX_SENTENCE = 4096
MAX_VALUES = 64
_HEALTH: tuple[Literal["ok", "warn", "error", "stale"], ...] = ("ok", "warn", "error", "stale")
_LEVELS: tuple[tuple[int, Literal["debug", "info", "warn", "error", "fatal"]], ...] = (
    (50, "fatal"), (40, "error"), (30, "warn"), (20, "info"), (0, "debug"),
)  # fmt: skip
"""The least number of each level."""
_DEBUG = 10


def log_line(message: Ros) -> Iterable[Log]:
    """A line of ``/rosout``."""
    level = next(name for least, name in _LEVELS if message["level"] >= least)
    name = message["name"][:MAX_NAME] or None
    yield Log(level=level, message=message["msg"][:MAX_SENTENCE], name=name, timestamp=stamp_us(message["stamp"]))


def log_fields(message: Log, origin: Origin) -> Ros:
    """A ``rcl_interfaces/Log``."""
    level = next(least for least, name in _LEVELS if name == message.level)
    stamp = ros_stamp(message.timestamp or origin.stamp_us)
    return {"stamp": stamp, "level": level or _DEBUG, "name": message.name or "", "msg": message.message}


def diagnostics(message: Ros) -> Iterable[Diagnostic]:
    """One message for each part of the robot."""
    for status in message["status"]:
        yield _diagnostic(status, timestamp=stamp_us(message["header"]["stamp"]))


def diagnostic_alone(message: Ros) -> Iterable[Diagnostic]:
    """A status that was sent without others."""
    yield _diagnostic(message)


def _diagnostic(status: Ros, **more: Any) -> Diagnostic:
    values = {one["key"][:MAX_NAME]: one["value"][:MAX_SENTENCE] for one in status["values"][:MAX_VALUES]}
    return Diagnostic(
        level=_HEALTH[min(status["level"], 3)],
        name=status["name"][:MAX_NAME],
        message=status["message"][:MAX_SENTENCE],
        hardware_id=status["hardware_id"][:MAX_NAME] or None,
        values=values,
        **more,
    )


def diagnostic_fields(message: Diagnostic, origin: Origin) -> Ros:
    """A ``diagnostic_msgs/DiagnosticStatus``, which has no time."""
    return {
        "level": _HEALTH.index(message.level),
        "name": message.name,
        "message": message.message,
        "hardware_id": message.hardware_id or "",
        "values": [{"key": key, "value": value} for key, value in message.values.items()],
    }


def diagnostics_fields(message: Diagnostic, origin: Origin) -> Ros:
    """A ``diagnostic_msgs/DiagnosticArray`` of one, as on ``/diagnostics``."""
    return {"header": ros_header(origin, message), "status": [diagnostic_fields(message, origin)]}
