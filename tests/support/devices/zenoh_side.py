"""The side of ROS over Zenoh in tests: a router and a node of rmw_zenoh, made without any code of the plugin."""

from __future__ import annotations

import json
import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import zenoh
import zenoh.ext

from support.devices.ros_side import STORE, dds_name_of, decoded, encoded
from support.processes import free_port

GID = bytes(range(16))
SET_BOOL_HASH = "RIHS01_" + "5" * 64


def beside(number: int) -> bytes:
    return struct.pack("<qq", number, time.time_ns()) + bytes([16]) + GID


def opened(mode: str, **settings: Any) -> Any:
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
        **settings,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


class ZenohRos:
    """A router, and a node in a domain of it."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self.router = f"tcp/127.0.0.1:{free_port()}"
        self._router = opened("router", **{"listen/endpoints": [self.router]})
        self.session = opened("client", **{"connect/endpoints": [self.router]})
        self._kept: list[Any] = []
        self._number = 0

    def token(self, kind: str, name: str, type_name: str, type_hash: str, qos: str = "::,10:,:,:,,") -> Any:
        self._number += 1
        mangled = name.replace("/", "%")
        key = (
            f"@ros2_lv/{self.domain}/{self.session.zid()}/0/{self._number}/{kind}/%/%/node/{mangled}/"
            f"{dds_name_of(type_name)}/{type_hash}/{qos}"
        )
        self._kept.append(self.session.liveliness().declare_token(key))
        return self._kept[-1]

    def key(self, name: str, type_name: str, type_hash: str) -> str:
        return f"{self.domain}/{name.strip('/')}/{dds_name_of(type_name)}/{type_hash}"

    def publisher(
        self, topic: str, name: str, qos: str = "2::,5:,:,:,,"
    ) -> Callable[[Mapping[str, Any] | bytes], None]:
        """What publishes values, or bytes as they are."""
        type_hash = STORE.hash_rihs01(name)
        publisher = self.session.declare_publisher(self.key(topic, name, type_hash))
        self.token("MP", topic, name, type_hash, qos)
        self._kept.append(publisher)

        def publish(told: Mapping[str, Any] | bytes) -> None:
            publisher.put(told if isinstance(told, bytes) else encoded(name, told), attachment=beside(1))

        return publish

    def latched(self, topic: str, name: str, values: Mapping[str, Any]) -> None:
        """A transient local publisher that has said something."""
        type_hash = STORE.hash_rihs01(name)
        publisher = zenoh.ext.declare_advanced_publisher(
            self.session, self.key(topic, name, type_hash), cache=zenoh.ext.CacheConfig(1), publisher_detection=True
        )
        publisher.put(encoded(name, values), attachment=beside(1))
        self._kept.append(publisher)
        self.token("MP", topic, name, type_hash, ":1:,1:,:,:,,")

    def subscription(self, topic: str, name: str) -> list[Any]:
        """What comes, into this list."""
        heard: list[Any] = []
        type_hash = STORE.hash_rihs01(name)
        subscriber = self.session.declare_subscriber(
            self.key(topic, name, type_hash), lambda sample: heard.append(decoded(name, sample.payload.to_bytes()))
        )
        self._kept.append(subscriber)
        self.token("MS", topic, name, type_hash)
        return heard

    def server(self, service: str, type_name: str, answer: Callable[[Any], Mapping[str, Any]]) -> None:
        package, _, own = type_name.split("/")

        def reply(query: Any) -> None:
            request = decoded(f"{package}/msg/{own}_Request", query.payload.to_bytes())
            body = encoded(f"{package}/msg/{own}_Response", answer(request))
            query.reply(query.key_expr, body, attachment=query.attachment)
            query.drop()

        key = self.key(service, type_name, SET_BOOL_HASH)
        self._kept.append(
            self.session.declare_queryable(
                key, lambda query: threading.Thread(target=reply, args=(query,), daemon=True).start(), complete=True
            )
        )
        self.token("SS", service, type_name, SET_BOOL_HASH)

    def close(self) -> None:
        self.session.close()
        self._router.close()
