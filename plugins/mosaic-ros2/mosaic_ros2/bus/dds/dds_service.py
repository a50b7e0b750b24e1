"""Calls ROS services over DDS, as rmw_cyclonedds builds requests: a header of 16 bytes before the message, with a
number of the client and one of the request, which the reply brings back (its ``cdds_request_header_t``).

rmw_fastrtps puts the same into the RTPS packet's inline QoS (related sample identity), which Cyclone's Python API does
not reach. Such a server takes our header for a part of the request (ros2/rmw_cyclonedds issues 184 and 577: it may
even run out of memory), so none is ever sent to it.
"""

from __future__ import annotations

import secrets
import struct
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from mosaic_ros2.bus.bus import BusError, HeardEndpoint
from mosaic_ros2.bus.dds.dds_topics import DdsPublication, WaitingReader
from mosaic_ros2.bus.qos import RELIABLE
from mosaic_ros2.bus.ros_names import reply_topic_of, request_topic_of
from mosaic_ros2.bus.silence import OTHER_RMW
from mosaic_ros2.cdr.cursor import HEADER_BYTES

_HEADER = struct.Struct("<Qq")
_BIG_HEADER = struct.Struct(">Qq")
LOOK_S = 0.05
"""How often a call looks whether it is over."""
MATCH_S = 3.0
"""Longest wait until the server has found this client."""
GONE_S = 1.0
"""How long a reply of a server that is gone may still be on its way."""
GONE_CURE = "look whether its node has crashed; whether it did what was asked is not known"
MAX_REPLIES = 64


class DdsServiceCaller:
    """Calls one service. Calls of several threads share the client; whoever waits reads for all."""

    def __init__(
        self,
        service: str,
        topic_of: Callable[[str, str], tuple[Any, Any]],
        type_name: str,
        endpoints: Callable[[], Sequence[HeardEndpoint]],
    ) -> None:
        self._service = service
        self._type_name = type_name
        self._endpoints = endpoints
        self._requests = DdsPublication(*topic_of(request_topic_of(service), f"{type_name}_Request"), RELIABLE)
        self._replies = WaitingReader(*topic_of(reply_topic_of(service), f"{type_name}_Response"), RELIABLE)
        self._client = secrets.randbits(63)
        self._number = 0
        self._lock = threading.Lock()
        self._reading = threading.Lock()
        self._waits_for: set[int] = set()
        self._came: dict[int, bytes] = {}

    def call(self, data: bytes, is_over: Callable[[], bool]) -> bytes | None:
        if not self._is_matched(is_over):
            return None
        with self._lock:
            self._number += 1
            number = self._number
            self._waits_for.add(number)
        try:
            header = _HEADER.pack(self._client, number)
            servers = set(self._replies.writers)
            self._requests.write(data[:HEADER_BYTES] + header + data[HEADER_BYTES:])
            return self._awaited(number, servers, is_over)
        finally:
            with self._lock:
                self._waits_for.discard(number)
                self._came.pop(number, None)

    def _awaited(self, number: int, servers: set[int], is_over: Callable[[], bool]) -> bytes | None:
        """The reply to this request. A server that was started anew knows nothing of it."""
        seen_at_s = time.monotonic()
        while not is_over():
            self._read()
            if number in self._came:
                return self._came[number]
            if not servers.isdisjoint(self._replies.writers):
                seen_at_s = time.monotonic()
            elif time.monotonic() - seen_at_s > GONE_S:
                raise BusError(f"the server of {self._service} is gone, and with it the answer", GONE_CURE)
        return None

    def _is_matched(self, is_over: Callable[[], bool]) -> bool:
        """Whether a server hears requests and is heard; a request that was sent before would be lost."""
        patience = round(MATCH_S / LOOK_S)
        while not (self._requests.readers and self._replies.writers):
            patience -= 1
            if is_over():
                return False
            if patience <= 0:
                raise BusError(*self._why_unmatched())
            self._read()
        if any(one.is_foreign_service and one.name == self._service for one in self._endpoints()):
            raise BusError(f"the server of {self._service} speaks Fast DDS' way of requests", OTHER_RMW)
        return True

    def _why_unmatched(self) -> tuple[str, str]:
        servers = [one for one in self._endpoints() if one.role == "server" and one.name == self._service]
        if not servers:
            return f"no server of {self._service} is heard", "is its node running, in this domain?"
        kind = servers[0].type
        if kind != self._type_name:
            return f"{self._service} is of the type {kind}, not {self._type_name}", f"write `type: {kind}`"
        return f"the server of {self._service} has other fields than are known here", "write its `distribution` of ROS"

    def _read(self) -> None:
        with self._reading:
            for sample in self._replies.take(LOOK_S):
                packed = _HEADER if len(sample.data) > 1 and sample.data[1] & 1 else _BIG_HEADER
                body = sample.data[HEADER_BYTES:]
                if len(body) < packed.size:
                    continue
                client, number = packed.unpack_from(body)
                with self._lock:
                    if client == self._client and number in self._waits_for and len(self._came) < MAX_REPLIES:
                        self._came[number] = sample.data[:HEADER_BYTES] + body[packed.size :]

    def close(self) -> None:
        self._requests.close()
        self._replies.close()
