"""Writes and reads the key expressions and attachments of rmw_zenoh, as its design document has them. Pure.

A topic's key is ``<domain>/<name>/<DDS type>/<type hash>``; each publisher, subscription, server and client announces
itself by a liveliness token ``@ros2_lv/<domain>/<session>/<node>/<id>/<kind>/<enclave>/<namespace>/<node name>/<name>/
<type>/<hash>/<QoS>``, in which every ``/`` of a part is a ``%``.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from mosaic_ros2.bus.bus import EndpointRole, HeardEndpoint
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.definitions.definition import DefinitionError, dds_name, full_name

ADMIN_SPACE = "@ros2_lv"
NODE_NAME = "mosaic"
ANY_HASH = "*"
_KINDS: dict[str, EndpointRole] = {"MP": "publisher", "MS": "subscription", "SS": "server", "SC": "client"}
_OF_ROLE = {role: kind for kind, role in _KINDS.items()}
_PARTS = 13
_USUAL_DEPTH = 42
"""What rmw_zenoh means where a token says nothing: reliable, volatile, the last 42."""
_ATTACHMENT = struct.Struct("<qqB16s")
"""Number, time in ns since 1970, and 16 bytes that name the sender, with their count before them."""


@dataclass(frozen=True, slots=True)
class Token:
    """Somebody's endpoint, as its liveliness token tells. ``hash``: of its type, as it stands in keys."""

    session: str
    endpoint: HeardEndpoint
    hash: str


def key_of(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """The key of a topic or service."""
    return f"{domain}/{name.strip('/')}/{dds_name(type_name)}/{type_hash}"


def tokens_of(domain: int) -> str:
    """All tokens of a domain."""
    return f"{ADMIN_SPACE}/{domain}/**"


def node_token(domain: int, session: str) -> str:
    """The token of our own node."""
    return f"{ADMIN_SPACE}/{domain}/{session}/0/0/NN/%/%/{NODE_NAME}"


def token_of(domain: int, session: str, number: int, endpoint: HeardEndpoint, type_hash: str) -> str:
    """The token of an endpoint of ours."""
    parts = (endpoint.name.replace("/", "%"), dds_name(endpoint.type), type_hash, _qos_text(endpoint.qos))
    kind = _OF_ROLE[endpoint.role]
    return f"{ADMIN_SPACE}/{domain}/{session}/0/{number}/{kind}/%/%/{NODE_NAME}/{'/'.join(parts)}"


def read_token(key: str) -> Token | None:
    """The endpoint that a token announces; ``None`` for nodes, and for what is none of ROS'."""
    parts = key.split("/")
    if len(parts) != _PARTS or parts[0] != ADMIN_SPACE or parts[5] not in _KINDS:
        return None
    name, kind, type_hash, qos = parts[9].replace("%", "/"), parts[10].replace("%", "/"), parts[11], parts[12]
    try:
        type_name = full_name(kind)
    except DefinitionError:
        return None
    return Token(parts[2], HeardEndpoint(name, type_name, _KINDS[parts[5]], _read_qos(qos)), type_hash)


def _qos_text(qos: QosProfile) -> str:
    reliability, durability = "" if qos.is_reliable else "2", "1" if qos.is_latched else ""
    return f"{reliability}:{durability}:,{qos.depth}:,:,:,,"


def _read_qos(text: str) -> QosProfile:
    reliability, durability, history, *_ = (*text.split(":"), "", "", "")
    depth = history.partition(",")[2]
    return QosProfile(reliability != "2", durability == "1", int(depth) if depth.isdigit() else _USUAL_DEPTH)


def attachment(number: int, sent_at_ns: int, sender: bytes) -> bytes:
    """What goes beside a message."""
    return _ATTACHMENT.pack(number, sent_at_ns, len(sender), sender)


def read_attachment(data: bytes) -> tuple[int, int] | None:
    """The number and the time of a message; ``None``: that is no attachment of ROS."""
    if len(data) != _ATTACHMENT.size:
        return None
    number, sent_at_ns, *_ = _ATTACHMENT.unpack(data)
    return number, sent_at_ns
