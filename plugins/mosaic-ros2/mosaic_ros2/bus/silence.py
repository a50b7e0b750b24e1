"""Says why a topic is silent: what was tried, what is heard instead, and what to do. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from mosaic_core.words.errors import hint_at
from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.qos import QosProfile, misfits
from mosaic_ros2.bus.ros_names import is_hidden

SHOWN = 6
NOTHING_CURE = (
    "is a node running, with the same ROS_DOMAIN_ID (`domain`)? A firewall, another network (`interface`, `peers`), "
    "ROS_LOCALHOST_ONLY on the other computer or another `transport` hide it"
)

OTHER_RMW = (
    "start its node with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or all of ROS with rmw_zenoh_cpp and `transport: zenoh`"
)
"""The cure for services and actions of Fast DDS' nodes."""


def shown(names: Iterable[str]) -> str:
    """The first names, and how many more there are."""
    every = sorted(set(names))
    more = f" and {len(every) - SHOWN} more" if len(every) > SHOWN else ""
    return ", ".join(every[:SHOWN]) + more


def why_silent(topic: str, where: str, endpoints: Sequence[HeardEndpoint]) -> tuple[str, str]:
    """What to tell, and the cure, where nobody publishes ``topic``."""
    if not endpoints:
        return f"nothing of ROS is heard on {where}, and so no {topic}", NOTHING_CURE
    published = {one.name for one in endpoints if one.role == "publisher"}
    heard = [name for name in published if not is_hidden(name)]
    if not heard:
        return f"nobody publishes {topic} on {where}; nodes are heard, and no topic of theirs", "start its node"
    what = f"nobody publishes {topic} on {where}{hint_at(topic, heard)} Heard: {shown(heard)}"
    return what, "start its node, or correct the name"


def why_unheard(topic: str, wanted: str, offered: QosProfile, endpoints: Sequence[HeardEndpoint]) -> tuple[str, str]:
    """What to tell, and the cure, where nobody hears what is published on ``topic`` as ``wanted``."""
    subscribed = [one for one in endpoints if one.role == "subscription" and not is_hidden(one.name)]
    kinds = sorted({one.type for one in subscribed if one.name == topic})
    if kinds and wanted not in kinds:
        return f"{topic} is taken as {' and '.join(kinds)}, not as {wanted}", f"publish it as {kinds[0]}"
    for one in subscribed:
        if one.name == topic and (reasons := misfits(offered, one.qos)):
            return f"who subscribes to {topic} does not hear it: {'; '.join(reasons)}", "ask for less there"
    hint = hint_at(topic, {one.name for one in subscribed} - {topic}).rstrip(".")
    return f"nobody subscribes to {topic}{hint}", "start the node that shall take it"


def why_foreign_services(endpoints: Iterable[HeardEndpoint]) -> str:
    """What to tell of services and actions that can't be called from here, and the cure; nothing of none."""
    names = {
        one.name.partition("/_action/")[0] for one in endpoints if one.is_foreign_service and not is_of_every_node(one)
    }
    return f"Fast DDS builds requests another way: {shown(names)} can't be called; {OTHER_RMW}" if names else ""


def is_of_every_node(server: HeardEndpoint) -> bool:
    """Whether it is one of the services for parameters and types, which every node has."""
    return server.type.split("/")[0] in ("rcl_interfaces", "type_description_interfaces")


def why_other_type(topic: str, wanted: str, publishers: Sequence[HeardEndpoint]) -> tuple[str, str] | None:
    """What to tell where every publisher has another type; ``None``: one has the wanted one."""
    kinds = sorted({one.type for one in publishers})
    if wanted in kinds:
        return None
    return f"{topic} is published as {' and '.join(kinds)}, not as {wanted}", f"write `type: {kinds[0]}`"


def why_unmatched(topic: str, publishers: Sequence[HeardEndpoint]) -> tuple[str, str]:
    """What to tell where publishers are heard by discovery, and still nothing of theirs comes."""
    kind = publishers[0].type
    what = f"{topic} is published as {kind}, with other fields than are known here"
    return what, "write the `distribution` of ROS that it runs on, or name its .msg file in `definitions`"


def why_unfit(topic: str, asked: QosProfile, publishers: Sequence[HeardEndpoint]) -> tuple[str, str] | None:
    """What to tell where no publisher offers what is asked for; ``None``: one does."""
    reasons = [misfits(one.qos, asked) for one in publishers]
    if not reasons or not all(reasons):
        return None
    return f"the publisher of {topic} is not heard: {'; '.join(reasons[0])}", "write `qos: auto`"
