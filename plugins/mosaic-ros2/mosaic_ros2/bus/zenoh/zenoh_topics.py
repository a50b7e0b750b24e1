"""Subscribes to topics and publishes on them, over Zenoh."""

from __future__ import annotations

import itertools
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

from mosaic_ros2.bus.bus import Arrived, BusError, HeardEndpoint
from mosaic_ros2.bus.qos import misfits
from mosaic_ros2.bus.zenoh.ros_keys import ANY_HASH, attachment, key_of, read_attachment
from mosaic_ros2.bus.zenoh.zenoh_session import ZenohSession


class ZenohSubscription:
    """Receives the messages of one topic, of publishers of any type hash; the newest few wait."""

    def __init__(self, session: ZenohSession, own: HeardEndpoint, hash_of: Callable[[str], str]) -> None:
        self._session = session
        self._own = own
        self._changed = threading.Condition()
        self._waiting: deque[Arrived] = deque(maxlen=max(1, own.qos.depth))
        key = key_of(session.domain, own.name, own.type, ANY_HASH)
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True) if own.qos.is_latched else None
        try:
            self._subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                session.zenoh, key, self._arrived, history=history
            )
            self._token = session.announced(own, hash_of(own.type))
        except zenoh.ZError as error:
            raise BusError(f"can't subscribe to {own.name}: {error}") from error

    def _arrived(self, sample: Any) -> None:
        """Zenoh's thread. What this robot publishes itself goes to others: a topic that is read and bridged would go
        round for ever."""
        beside = sample.attachment.to_bytes() if sample.attachment is not None else b""
        if beside.endswith(self._session.sender):
            return
        told = read_attachment(beside)
        arrived = Arrived(sample.payload.to_bytes(), told[1] if told is not None else 0)
        with self._changed:
            self._waiting.append(arrived)
            self._changed.notify()

    def take(self, timeout_s: float) -> list[Arrived]:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting, timeout_s)
            taken = list(self._waiting)
            self._waiting.clear()
        return taken

    @property
    def publishers(self) -> int:
        here = (one.endpoint for one in self._session.tokens())
        return sum(
            one.role == "publisher" and (one.name, one.type) == (self._own.name, self._own.type)
            and not misfits(one.qos, self._own.qos)
            for one in here
        )  # fmt: skip

    def close(self) -> None:
        self._subscriber.undeclare()
        self._token.undeclare()


class ZenohPublication:
    """Sends messages on one topic: to the key of the type's own hash, and to those that its subscriptions have.

    A subscription hears the key of its own hash alone; nodes of Humble, which knows no hashes, have another word there.
    """

    def __init__(self, session: ZenohSession, own: HeardEndpoint, hash_of: Callable[[str], str]) -> None:
        self._session = session
        self._own = own
        self._hash = hash_of(own.type)
        self._numbers = itertools.count(1)
        self._publishers: dict[str, Any] = {}
        try:
            self._publisher(self._hash)
            self._token = session.announced(own, self._hash)
        except zenoh.ZError as error:
            raise BusError(f"can't publish on {own.name}: {error}") from error

    def _publisher(self, type_hash: str) -> Any:
        if type_hash not in self._publishers:
            qos, latched = self._own.qos, self._own.qos.is_latched
            self._publishers[type_hash] = zenoh.ext.declare_advanced_publisher(
                self._session.zenoh,
                key_of(self._session.domain, self._own.name, self._own.type, type_hash),
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.RELIABLE if qos.is_reliable else zenoh.Reliability.BEST_EFFORT,
                cache=zenoh.ext.CacheConfig(qos.depth) if latched else None,
                publisher_detection=True if latched else None,
            )
        return self._publishers[type_hash]

    def _hearing(self) -> list[str]:
        """The hashes of the subscriptions that are there."""
        return [
            one.hash
            for one in self._session.tokens()
            if one.endpoint.role == "subscription"
            and (one.endpoint.name, one.endpoint.type) == (self._own.name, self._own.type)
        ]

    def write(self, data: bytes) -> None:
        beside = attachment(next(self._numbers), time.time_ns(), self._session.sender)
        try:
            for type_hash in {self._hash, *self._hearing()}:
                self._publisher(type_hash).put(data, attachment=beside)
        except zenoh.ZError as error:
            raise BusError(f"{self._own.name} takes no message: {error}") from error

    @property
    def readers(self) -> int:
        return len(self._hearing())

    def close(self) -> None:
        for publisher in self._publishers.values():
            publisher.undeclare()
        self._token.undeclare()
