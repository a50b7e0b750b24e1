"""Reads what Cyclone DDS has discovered: the writers and readers of others, as ROS' endpoints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState
from cyclonedds.domain import DomainParticipant

from mosaic_ros2.bus.bus import EndpointRole, HeardEndpoint
from mosaic_ros2.bus.dds.policies import profile_of
from mosaic_ros2.bus.ros_names import read_dds_topic
from mosaic_ros2.definitions.definition import DefinitionError, full_name

MAX_ENDPOINTS = 4096
FAST_DDS = b"\x01\x0f"
"""eProsima's vendor id, with which its endpoints' keys begin (DDSI-RTPS 8.2.4.1)."""
_ROLES: dict[tuple[str, bool], EndpointRole] = {
    ("topic", True): "publisher", ("topic", False): "subscription",
    ("request", True): "client", ("request", False): "server",
}  # fmt: skip
"""Kind of topic, and whether a writer is there → what it is. Replies say the same as requests once more."""


class Discovery:
    """Lists the endpoints of other participants."""

    def __init__(self, participant: DomainParticipant) -> None:
        self._own = participant.guid.bytes[:12]
        self._readers = [
            (BuiltinDataReader(participant, topic), is_writer)
            for topic, is_writer in ((BuiltinTopicDcpsPublication, True), (BuiltinTopicDcpsSubscription, False))
        ]

    def samples(self) -> Iterator[tuple[Any, bool]]:
        """What the others told of each endpoint, and whether it writes."""
        for reader, is_writer in self._readers:
            for sample in reader.read(MAX_ENDPOINTS):
                is_alive = sample.sample_info.instance_state == InstanceState.Alive
                if is_alive and hasattr(sample, "topic_name") and sample.key.bytes[:12] != self._own:
                    yield sample, is_writer

    def endpoints(self) -> list[HeardEndpoint]:
        """Those of ROS, in the order of their names."""
        found = [one for sample, is_writer in self.samples() if (one := _endpoint(sample, is_writer)) is not None]
        return sorted(found, key=lambda one: (one.name, one.role))


def _endpoint(sample: Any, is_writer: bool) -> HeardEndpoint | None:
    named = read_dds_topic(sample.topic_name)
    role = _ROLES.get((named[0], is_writer)) if named is not None else None
    if named is None or role is None:
        return None
    try:
        type_name = full_name(sample.type_name)
    except DefinitionError:
        type_name = sample.type_name
    is_foreign = role == "server" and sample.key.bytes[:2] == FAST_DDS
    return HeardEndpoint(named[1], type_name.removesuffix("_Request"), role, profile_of(sample.qos), is_foreign)
