"""Keeps one Zenoh session with a router, and knows who of ROS is alive there."""

from __future__ import annotations

import json
import re
import secrets
import threading
from collections.abc import Sequence
from typing import Any

import zenoh
import zenoh.handlers

from mosaic_ros2.bus.bus import BusError, HeardEndpoint
from mosaic_ros2.bus.zenoh.ros_keys import Token, node_token, read_token, token_of, tokens_of

ROUTER = "tcp/localhost:7447"
OPEN_TIMEOUT_MS = 2000
MAX_TOKENS = 8192


class ZenohSession:
    """A session that is a client of a router of rmw_zenoh. Any thread."""

    def __init__(self, domain: int, routers: Sequence[str]) -> None:
        """Raises :class:`BusError` where no router is."""
        self.domain = domain
        self.sender = secrets.token_bytes(16)
        """Names us beside our messages."""
        try:
            self.zenoh: Any = zenoh.open(_configuration(routers))
        except zenoh.ZError as error:
            cure = "start one: `ros2 run rmw_zenoh_cpp rmw_zenohd`; another computer's is named in `peers`"
            raise BusError(f"no Zenoh router at {', '.join(routers or (ROUTER,))}: {_told(error)}", cure) from error
        self.id = str(self.zenoh.zid())
        self._lock = threading.Lock()
        self._tokens: dict[str, Token] = {}
        self._numbers = iter(range(1, 1 << 62))
        self._node = self.zenoh.liveliness().declare_token(node_token(domain, self.id))
        # On Zenoh's own thread: one of Python's, which it would make, outlives the session, and the process never ends.
        changed = zenoh.handlers.Callback(self._changed, indirect=False)
        self._watch = self.zenoh.liveliness().declare_subscriber(tokens_of(domain), changed, history=True)

    def _changed(self, sample: Any) -> None:
        """Zenoh's thread: somebody came or went."""
        key = str(sample.key_expr)
        token = read_token(key)
        if token is None or token.session == self.id:
            return
        with self._lock:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._tokens.pop(key, None)
            elif len(self._tokens) < MAX_TOKENS:
                self._tokens[key] = token

    def tokens(self) -> list[Token]:
        """Everybody else's endpoints."""
        with self._lock:
            return list(self._tokens.values())

    def announced(self, endpoint: HeardEndpoint, type_hash: str) -> Any:
        """A token of ours: ROS' tools show us, and its nodes know that they are heard."""
        key = token_of(self.domain, self.id, next(self._numbers), endpoint, type_hash)
        return self.zenoh.liveliness().declare_token(key)

    def close(self) -> None:
        """End the session, which is what the others notice."""
        self.zenoh.close()


def _told(error: zenoh.ZError) -> str:
    """What Zenoh says of it, without the place in its own sources."""
    return re.sub(r" at \S+\.rs:\d+\.?", "", str(error))


def _configuration(routers: Sequence[str]) -> Any:
    """A client alone: the router passes everything on, and nothing here must be reached."""
    found = zenoh.Config()
    found.insert_json5("mode", '"client"')
    found.insert_json5("connect/endpoints", json.dumps(list(routers) or [ROUTER]))
    found.insert_json5("connect/timeout_ms", str(OPEN_TIMEOUT_MS))
    found.insert_json5("connect/exit_on_failure", "true")
    found.insert_json5("scouting/multicast/enabled", "false")
    found.insert_json5("timestamping/enabled", "true")  # latched publishers order what they keep by it
    return found
