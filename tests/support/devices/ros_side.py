"""The side of ROS in tests: nodes on a DDS participant of their own, made without any code of the plugin.

Types and bytes come from rosbags' definitions; on the wire Cyclone DDS has them by its own types.
"""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import final
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer Address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>"
)
"""Cyclone's configuration for nodes that meet on this machine alone."""
STORE = get_typestore(Stores.ROS2_KILTED)
SERVICES = {
    "std_srvs/msg/SetBool_Request": "bool data",
    "std_srvs/msg/SetBool_Response": "bool success\nstring message",
    "example_interfaces/msg/Fibonacci_Goal": "int32 order",
    "example_interfaces/msg/Fibonacci_Result": "int32[] sequence",
    "example_interfaces/msg/Fibonacci_Feedback": "int32[] sequence",
    "example_interfaces/msg/Fibonacci_SendGoal_Request": "unique_identifier_msgs/UUID goal_id\nFibonacci_Goal goal",
    "example_interfaces/msg/Fibonacci_SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "example_interfaces/msg/Fibonacci_GetResult_Request": "unique_identifier_msgs/UUID goal_id",
    "example_interfaces/msg/Fibonacci_GetResult_Response": "int8 status\nFibonacci_Result result",
    "example_interfaces/msg/Fibonacci_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\nFibonacci_Feedback feedback"
    ),
    "action_msgs/msg/CancelGoal_Request": "GoalInfo goal_info",
    "action_msgs/msg/CancelGoal_Response": "int8 return_code\nGoalInfo[] goals_canceling",
}
"""rosbags knows messages alone; on the wire these are of services and actions."""
FURTHER = {
    "control_msgs/msg/GripperCommand": "float64 position\nfloat64 max_effort",
    "foxglove_msgs/msg/Point2": "float64 x\nfloat64 y",
    "foxglove_msgs/msg/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a",
    "foxglove_msgs/msg/CircleAnnotation": (
        "builtin_interfaces/Time timestamp\nPoint2 position\nfloat64 diameter\nfloat64 thickness\n"
        "Color fill_color\nColor outline_color"
    ),
    "foxglove_msgs/msg/PointsAnnotation": (
        "builtin_interfaces/Time timestamp\nuint8 type\nPoint2[] points\nColor outline_color\n"
        "Color[] outline_colors\nColor fill_color\nfloat64 thickness"
    ),
    "foxglove_msgs/msg/TextAnnotation": (
        "builtin_interfaces/Time timestamp\nPoint2 position\nstring text\nfloat64 font_size\n"
        "Color text_color\nColor background_color"
    ),
    "foxglove_msgs/msg/ImageAnnotations": (
        "CircleAnnotation[] circles\nPointsAnnotation[] points\nTextAnnotation[] texts"
    ),
}
"""Packages that rosbags does not bring."""
for _name, _text in (SERVICES | FURTHER).items():
    STORE.register(get_types_from_msg(_text, _name))

_PRIMITIVES: dict[str, Any] = {
    "bool": bool, "octet": types.uint8, "byte": types.uint8, "char": types.uint8, "int8": types.int8,
    "uint8": types.uint8,
    "int16": types.int16, "uint16": types.uint16, "int32": types.int32, "uint32": types.uint32, "int64": types.int64,
    "uint64": types.uint64, "float32": types.float32, "float64": types.float64, "string": str,
}  # fmt: skip
_DTYPES = {"octet": "u1", "byte": "u1", "char": "u1", "bool": "?"}
_HEADER = {"_client_guid": types.uint64, "_request_number": types.int64}


def made(name: str, values: Mapping[str, Any] | None = None) -> Any:
    """A message of rosbags; what is not in ``values`` is zero or empty."""
    values = dict(values or {})
    fields = {own: _value(node, values.pop(own, None)) for own, node in STORE.fielddefs[name][1]}
    assert not values, f"{name} has no {', '.join(values)}"
    return STORE.types[name](**fields)


def _value(node: Any, value: Any) -> Any:
    kind, content = node
    if kind is Nodetype.NAME:
        return made(content, value)
    if kind is Nodetype.BASE:
        zero = "" if content[0] == "string" else False if content[0] == "bool" else 0
        return zero if value is None else value
    (inner_kind, inner), size = content
    if inner_kind is Nodetype.BASE and inner[0] != "string":
        dtype = np.dtype(_DTYPES.get(inner[0], inner[0]))
        count = size if kind is Nodetype.ARRAY else 0
        return np.zeros(count, dtype) if value is None else np.asarray(value, dtype)
    return [_value((inner_kind, inner), one) for one in value or ()]


def encoded(name: str, values: Mapping[str, Any] | None = None) -> bytes:
    return bytes(STORE.serialize_cdr(made(name, values), name))


def decoded(name: str, data: bytes) -> Any:
    return STORE.deserialize_cdr(data, name)


class _Bytes:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.sample_info: Any = None


def _wire_type(name: str, dds_name: str, header: Mapping[str, Any], inner: dict[str, Any]) -> Any:
    fields = {**header, **{own: _wire_field(node, inner) for own, node in STORE.fielddefs[name][1]}}
    return final(make_idl_struct(dds_name.rsplit("::", 1)[-1], dds_name.replace("::", "."), fields, dataclassify=False))


def _wire_field(node: Any, inner: dict[str, Any]) -> Any:
    kind, content = node
    if kind is Nodetype.NAME:
        if content not in inner:
            package, _, own = content.split("/")
            kind_name = "action" if own.startswith("Fibonacci_") else "msg"
            inner[content] = _wire_type(content, f"{package}::{kind_name}::dds_::{own}_", {}, inner)
        return inner[content]
    if kind is Nodetype.BASE:
        return types.bounded_str[content[1]] if content[1] else _PRIMITIVES[content[0]]
    one, size = _wire_field(content[0], inner), content[1]
    if kind is Nodetype.ARRAY:
        return types.array[one, size]
    return types.sequence[one, size] if size else types.sequence[one]


def bytes_type(name: str, dds_name: str, header: Mapping[str, Any] | None = None) -> Any:
    """A type of Cyclone whose samples are bytes."""
    made_type: Any = _wire_type(name, dds_name, header or {}, {})
    made_type.deserialize = classmethod(lambda cls, data, **_: _Bytes(data))
    made_type.deserialize_key = classmethod(lambda cls, data, **_: None)
    made_type.serialize = lambda self, **_: self.data
    return made_type


def qos(*, reliable: bool = True, latched: bool = False, depth: int = 10) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
    )


def dds_name_of(name: str) -> str:
    package, kind, own = name.split("/")
    return f"{package}::{kind}::dds_::{own}_"


class RosWriter:
    """A publisher of a node."""

    def __init__(self, participant: Any, topic: str, name: str, wire: Any, policies: Qos) -> None:
        self.name = name
        self._wire = wire
        self._writer: Any = DataWriter(participant, Topic(participant, topic, wire), policies)

    @property
    def readers(self) -> int:
        return len(self._writer.get_matched_subscriptions())

    def write(self, values: Mapping[str, Any] | None = None) -> None:
        self.write_bytes(encoded(self.name, values))

    def write_bytes(self, data: bytes) -> None:
        sample = self._wire.__new__(self._wire)
        sample.data = data
        self._writer.write(sample)

    def close(self) -> None:
        self._writer = None


class RosReader:
    """A subscription of a node."""

    def __init__(self, participant: Any, topic: str, name: str, wire: Any, policies: Qos) -> None:
        self.name = name
        self._reader: Any = DataReader(participant, Topic(participant, topic, wire), policies)
        self._waiting = WaitSet(participant)
        self._unread = ReadCondition(self._reader, ViewState.Any | InstanceState.Any | SampleState.NotRead)
        self._waiting.attach(self._unread)

    @property
    def writers(self) -> int:
        return len(self._reader.get_matched_publications())

    def take_bytes(self, timeout_s: float = 5.0) -> list[bytes]:
        self._waiting.wait(duration(seconds=timeout_s))
        return [one.data for one in self._reader.take(100) if isinstance(one, _Bytes)]

    def take(self, timeout_s: float = 5.0) -> list[Any]:
        return [decoded(self.name, data) for data in self.take_bytes(timeout_s)]


class RosNode:
    """A node of ROS with rmw_cyclonedds, in a domain of its own on loopback."""

    def __init__(self, domain: int) -> None:
        self.participant: Any = DomainParticipant(domain)
        self._servers: list[RosServer] = []

    def publisher(self, topic: str, name: str, policies: Qos | None = None, dds_name: str = "") -> RosWriter:
        wire = bytes_type(name, dds_name or dds_name_of(name))
        return RosWriter(self.participant, f"rt{topic}", name, wire, policies or qos())

    def subscription(self, topic: str, name: str, policies: Qos | None = None) -> RosReader:
        return RosReader(self.participant, f"rt{topic}", name, bytes_type(name, dds_name_of(name)), policies or qos())

    def server(self, service: str, type_name: str, answer: Callable[[Any], Mapping[str, Any]]) -> RosServer:
        """``answer``: from the request of rosbags to the values of the response; on a thread of its own."""
        self._servers.append(RosServer(self.participant, service, type_name, answer))
        return self._servers[-1]

    def close(self) -> None:
        for server in self._servers:
            server.close()
        self._servers.clear()
        # Collected it would be later, and not before whatever a thread still holds of it, and then is a circle.
        self.participant.__del__()
        self.participant = None


class RosServer:
    """A service of a node, as rmw_cyclonedds has it: 16 bytes of header before request and response."""

    def __init__(
        self, participant: Any, service: str, type_name: str, answer: Callable[[Any], Mapping[str, Any]]
    ) -> None:
        package, _, own = type_name.split("/")
        self._request, self._response = (f"{package}/msg/{own}_{part}" for part in ("Request", "Response"))
        requests = bytes_type(self._request, dds_name_of(f"{type_name}_Request"), _HEADER)
        responses = bytes_type(self._response, dds_name_of(f"{type_name}_Response"), _HEADER)
        self._reader = RosReader(participant, f"rq{service}Request", self._request, requests, qos())
        self._writer = RosWriter(participant, f"rr{service}Reply", self._response, responses, qos())
        self._answer = answer
        self._is_closing = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while not self._is_closing.is_set():
            for data in self._reader.take_bytes(0.05):
                threading.Thread(target=self._reply, args=(data,), daemon=True).start()

    def _reply(self, data: bytes) -> None:
        client, number = struct.unpack_from("<Qq", data, 4)
        request = decoded(self._request, data[:4] + data[20:])
        body = encoded(self._response, self._answer(request))
        if not self._is_closing.is_set():
            self.reply(client, number, body)

    def reply(self, client: int, number: int, body: bytes) -> None:
        """A reply to this request of this client, or to nobody's."""
        self._writer.write_bytes(body[:4] + struct.pack("<Qq", client, number) + body[4:])

    def close(self) -> None:
        self._is_closing.set()
        self._thread.join(2)
        self._writer.close()
