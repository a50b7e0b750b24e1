"""Calls ROS services over Zenoh: a query on the service's key, with the request as its payload."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh

from mosaic_ros2.bus.bus import BusError, HeardEndpoint
from mosaic_ros2.bus.zenoh.ros_keys import attachment, key_of
from mosaic_ros2.bus.zenoh.zenoh_session import ZenohSession

LOOK_S = 0.05
MATCH_S = 3.0
"""Longest wait until a server is heard."""
QUERY_S = 86_400.0
"""Zenoh gives a query up by itself; results of actions take long."""


class ZenohServiceCaller:
    """Calls one service, any number of calls at a time. The key has the type hash of the server that is heard."""

    def __init__(self, session: ZenohSession, own: HeardEndpoint) -> None:
        self._session = session
        self._own = own
        self._numbers = itertools.count(1)

    def call(self, data: bytes, is_over: Callable[[], bool]) -> bytes | None:
        type_hash = self._server(is_over)
        if type_hash is None:
            return None
        waits, replies = threading.Event(), []

        def replied(reply: Any) -> None:
            """Zenoh's thread."""
            replies.append(reply)
            waits.set()

        key = key_of(self._session.domain, self._own.name, self._own.type, type_hash)
        beside = attachment(next(self._numbers), time.time_ns(), self._session.sender)
        try:
            self._session.zenoh.get(
                key,
                replied,
                payload=data,
                attachment=beside,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=QUERY_S,
            )
        except zenoh.ZError as error:
            raise BusError(f"{self._own.name} can't be called: {error}") from error
        while not waits.wait(LOOK_S):
            if is_over():
                return None
        return self._payload(replies[0])

    def _payload(self, reply: Any) -> bytes:
        if reply.ok is None:
            raise BusError(f"{self._own.name} did not answer: {reply.err.payload.to_string()[:200]}")
        return bytes(reply.ok.payload.to_bytes())

    def _server(self, is_over: Callable[[], bool]) -> str | None:
        """The type hash of the server that is heard; ``None`` if it is over before."""
        until_s = time.monotonic() + MATCH_S
        while True:
            here = [
                one
                for one in self._session.tokens()
                if (one.endpoint.role, one.endpoint.name) == ("server", self._own.name)
            ]
            fitting = [one.hash for one in here if one.endpoint.type == self._own.type]
            if fitting:
                return fitting[0]
            if is_over():
                return None
            if time.monotonic() > until_s:
                raise BusError(*self._why(here[0].endpoint.type if here else ""))
            time.sleep(LOOK_S)

    def _why(self, kind: str) -> tuple[str, str]:
        if kind:
            return f"{self._own.name} is of the type {kind}, not {self._own.type}", f"write `type: {kind}`"
        return f"no server of {self._own.name} is heard", "is its node running, in this domain?"

    def close(self) -> None:
        """A query ends by itself."""
