"""Counts the connections of every address. Pure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(slots=True, eq=False)
class EntrancePlace:
    """The place of one connection. Nobody is served by an idle one: it goes when its address needs the place."""

    address: str | None
    """``None``: a proxy that speaks for many; it counts in the whole alone."""
    close: Callable[[], object] = lambda: None
    """Ends the connection at once; whoever takes the place sets it."""
    is_busy: bool = False
    """It serves a request or is a WebSocket."""


class Places:
    """Gives out places: ``per_address`` to each address, ``in_all`` together. One thread (the event loop).

    Where they are used up, the oldest idle connection of the same address makes room, or, where the whole is full, of
    the address that holds most. So connections that say nothing keep out nobody who does.
    """

    def __init__(self, per_address: int, in_all: int) -> None:
        self._per_address = per_address
        self._in_all = in_all
        self._held: dict[str | None, dict[EntrancePlace, None]] = {}
        self._count = 0

    def take(self, address: str | None) -> EntrancePlace | None:
        """``None``: all are busy."""
        mine = self._held.get(address, {})
        if address is not None and len(mine) >= self._per_address and not self._makes_room(mine):
            return None
        if self._count >= self._in_all and not self._makes_room(max(self._held.values(), key=len)):
            return None
        place = EntrancePlace(address)
        self._held.setdefault(address, {})[place] = None
        self._count += 1
        return place

    def leave(self, place: EntrancePlace) -> None:
        """The connection is over. A second time this does nothing."""
        mine = self._held.get(place.address, {})
        if place not in mine:
            return
        del mine[place]
        self._count -= 1
        if not mine:
            del self._held[place.address]

    def _makes_room(self, places: dict[EntrancePlace, None]) -> bool:
        idle = next((place for place in places if not place.is_busy), None)
        if idle is None:
            return False
        self.leave(idle)
        idle.close()
        return True
