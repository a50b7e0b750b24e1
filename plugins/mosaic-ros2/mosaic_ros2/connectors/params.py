"""Models what all connectors of this distribution are told: which ROS, over what, and which topic."""

from __future__ import annotations

import os
from typing import Annotated, Literal, TypeAlias, cast

from pydantic import AfterValidator, Field

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.params import Params
from mosaic_ros2.bus.qos import QosChoice
from mosaic_ros2.bus.ros_names import ros_name
from mosaic_ros2.bus.shared_bus import BusChoice, SharedBus, TypeChoice
from mosaic_ros2.definitions.bundled import DISTRIBUTIONS
from mosaic_ros2.definitions.definition import action_name, full_name, service_name

RosName: TypeAlias = Annotated[str, AfterValidator(ros_name)]
TypeName: TypeAlias = Annotated[str, AfterValidator(lambda name: full_name(name))]
ServiceTypeName: TypeAlias = Annotated[str, AfterValidator(service_name)]
ActionTypeName: TypeAlias = Annotated[str, AfterValidator(action_name)]
Transport: TypeAlias = Literal["dds", "zenoh"]
Distribution: TypeAlias = Literal["humble", "iron", "jazzy", "kilted"]
MAX_DOMAIN = 232
"""DDS has ports for no more."""


def own_domain() -> int:
    """``ROS_DOMAIN_ID`` of this shell, else 0."""
    text = os.environ.get("ROS_DOMAIN_ID", "")
    return int(text) if text.isdigit() and int(text) <= MAX_DOMAIN else 0


def own_distribution() -> Distribution:
    """``ROS_DISTRO`` of this shell, else the newest that is known."""
    found = os.environ.get("ROS_DISTRO", "")
    return cast(Distribution, found) if found in DISTRIBUTIONS else "kilted"


class Ros2Params(Params):
    """Which ROS a connector belongs to. Connectors that say the same share one participant."""

    transport: Transport = Field(
        default="dds", description="dds: nodes whose RMW is Fast DDS or Cyclone DDS; zenoh: those of rmw_zenoh."
    )
    domain: int = Field(
        default_factory=own_domain,
        ge=0,
        le=MAX_DOMAIN,
        description="ROS_DOMAIN_ID of the nodes; default: this shell's.",
    )
    interface: str = Field(
        default="",
        max_length=64,
        description="DDS: network interface or its address, lo say; default: Cyclone's choice.",
    )
    peers: tuple[str, ...] = Field(
        default=(),
        max_length=64,
        description="DDS: addresses of hosts that multicast does not reach. Zenoh: endpoints of routers; default: "
        "tcp/localhost:7447.",
    )
    distribution: Distribution = Field(
        default_factory=own_distribution,
        description="Distribution of ROS, where a few messages had other fields; default: this shell's, else kilted.",
    )
    definitions: tuple[str, ...] = Field(
        default=(),
        max_length=256,
        description=".msg, .srv and .action files, or folders of packages, for types that are not bundled.",
    )

    def bus(self, shared: Shared) -> SharedBus:
        """The bus that all connectors with these params share."""
        return SharedBus.of(
            shared,
            BusChoice(
                self.transport, self.domain, self.interface, self.peers, TypeChoice(self.definitions, self.distribution)
            ),
        )


class ReadsTopicParams(Ros2Params):
    """A topic that is read, and how."""

    topic: RosName = Field(description="Its name, like /scan.")
    qos: QosChoice = Field(
        default="auto",
        description="auto: the most that all its publishers offer; sensor: best effort; reliable; latched: reliable "
        "and transient local.",
    )
    depth: int = Field(
        default=0, ge=0, le=1000, description="Messages that wait at most; 0: as the publishers have it."
    )
    silence_s: float = Field(
        default=5.0, gt=0, le=600, description="Seconds without any publisher after which the connector says so."
    )
