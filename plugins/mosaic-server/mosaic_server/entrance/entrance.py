"""The entrance of one server: who gets a connection, and what happens to it before its first request."""

from __future__ import annotations

import resource
import time
from collections.abc import Collection

from mosaic_server.entrance.bounds import Bounds
from mosaic_server.entrance.places import EntrancePlace, Places
from mosaic_server.entrance.proxies import TrustedProxies
from mosaic_server.entrance.refusals import Refusals
from mosaic_server.security.address_prefix import counted_address

TOO_MANY = "a connection (its address holds as many as it may)"
RESERVED_FILES = 128
"""File descriptors for the database, the dashboard's files and the log."""
_ENOUGH_FILES = 65_536


class Entrance:
    """Admits connections, as many as the bounds allow. Event-loop thread only."""

    def __init__(self, bounds: Bounds, trusted_proxies: Collection[str] = ()) -> None:
        in_all = max(64, _file_limit() - RESERVED_FILES)
        self.bounds = bounds
        self.refusals = Refusals()
        self._proxies = TrustedProxies(trusted_proxies)
        self._places = Places(min(bounds.connections_per_address, in_all // 2), in_all)

    def take(self, address: str) -> EntrancePlace | None:
        """A place for a connection from there, or ``None``, which is told in the log."""
        place = self._places.take(None if address in self._proxies else counted_address(address))
        if place is None:
            self.refusals.note(TOO_MANY, address, time.monotonic())
        return place

    def leave(self, place: EntrancePlace) -> None:
        self._places.leave(place)

    def tick(self) -> None:
        """Call about once a second."""
        self.refusals.tick(time.monotonic())


def _file_limit() -> int:
    """Raises the soft limit of file descriptors to what this process may have: most systems start it with 1 024."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _ENOUGH_FILES if hard == resource.RLIM_INFINITY else min(hard, _ENOUGH_FILES)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        return wanted
    return wanted if soft == resource.RLIM_INFINITY else soft
