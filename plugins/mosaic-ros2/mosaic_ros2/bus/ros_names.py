"""Names of topics and services: as ROS has them, and as DDS carries them (``rt/``, ``rq/…Request``, ``rr/…Reply``).

The mapping is that of https://design.ros2.org/articles/topic_and_service_names.html. Pure.
"""

from __future__ import annotations

import re

_NAME = re.compile(r"^/?([A-Za-z_][A-Za-z0-9_]*)(/[A-Za-z_][A-Za-z0-9_]*)*$")
MAX_LENGTH = 240
"""DDS allows 256, with prefix and ending."""


def ros_name(name: str) -> str:
    """``scan`` and ``/scan`` as ``/scan``. Raises :class:`ValueError`."""
    text = name.strip()
    if not _NAME.match(text) or len(text) > MAX_LENGTH:
        raise ValueError(f"{name[:80]!r} is no name of ROS; write it like /scan or /arm/joint_states")
    return text if text.startswith("/") else f"/{text}"


def topic_of(name: str) -> str:
    """The DDS topic of a ROS topic."""
    return f"rt{ros_name(name)}"


def request_topic_of(service: str) -> str:
    """The DDS topic of a service's requests."""
    return f"rq{ros_name(service)}Request"


def reply_topic_of(service: str) -> str:
    """The DDS topic of a service's replies."""
    return f"rr{ros_name(service)}Reply"


def read_dds_topic(topic: str) -> tuple[str, str] | None:
    """``("topic" | "request" | "reply", ROS name)``; ``None``: no topic of ROS."""
    for prefix, kind, ending in (("rt/", "topic", ""), ("rq/", "request", "Request"), ("rr/", "reply", "Reply")):
        if topic.startswith(prefix) and topic.endswith(ending):
            return kind, topic[2 : len(topic) - len(ending)]
    return None


def is_hidden(name: str) -> bool:
    """Whether it is one of those that ROS keeps to itself: actions' parts, parameter events."""
    return any(part.startswith("_") for part in name.split("/")) or name in ("/parameter_events", "/rosout")
