"""A network address translator, as RFC 4787 describes them: which public endpoint a packet leaves from, and who inside
gets what arrives there. The time and the choice of ports are arguments.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

Endpoint = tuple[str, int]
"""Host and port."""

NatKind = Literal["full-cone", "address-restricted", "port-restricted", "symmetric"]
"""RFC 3489's words: the first three keep one public endpoint for each inner one and differ in who may answer to it;
``symmetric`` takes another one for every destination, and lets only that one answer."""

NAT_KINDS: tuple[NatKind, ...] = ("full-cone", "address-restricted", "port-restricted", "symmetric")
IDLE_S = 30.0
"""After which a mapping that nothing left through is forgotten; RFC 4787 asks for two minutes, many give this."""
PORTS = range(1024, 65536)


@dataclass(slots=True)
class _Mapping:
    inside: Endpoint
    destination: Endpoint | None
    ends_at_s: float
    spoken_to: dict[Endpoint, float] = field(default_factory=dict)
    """Until when somebody outside may answer."""


class Nat:
    """Translates addresses as a NAT with one public address.

    ``choose(count)`` returns a number below ``count``: where to look for the next free port.
    """

    def __init__(self, kind: NatKind, public_host: str, choose: Callable[[int], int], *, ports: range = PORTS) -> None:
        self.kind = kind
        self.public_host = public_host
        self._choose = choose
        self._all_ports = ports
        self._by_port: dict[int, _Mapping] = {}
        self._ports: dict[tuple[Endpoint, Endpoint | None], int] = {}

    def outbound(self, inside: Endpoint, remote: Endpoint, now_s: float) -> Endpoint | None:
        """The public endpoint from which a packet to ``remote`` leaves; ``None``: no port is free, it is dropped."""
        key = (inside, remote if self.kind == "symmetric" else None)
        port = self._ports.get(key)
        if port is not None and self._by_port[port].ends_at_s <= now_s:
            self._forget(port)
            port = None
        if port is None:
            port = self._free_port(now_s)
            if port is None:
                return None
            self._ports[key] = port
            self._by_port[port] = _Mapping(inside, key[1], now_s)
        mapping = self._by_port[port]
        mapping.ends_at_s = mapping.spoken_to[remote] = now_s + IDLE_S
        return self.public_host, port

    def inbound(self, public: Endpoint, remote: Endpoint, now_s: float) -> Endpoint | None:
        """Who inside gets a packet that ``remote`` sent to ``public``; ``None``: it is filtered."""
        mapping = self._by_port.get(public[1])
        if public[0] != self.public_host or mapping is None or mapping.ends_at_s <= now_s:
            return None
        return mapping.inside if self._lets_in(mapping, remote, now_s) else None

    def mapped(self, now_s: float) -> int:
        """How many mappings are alive."""
        return sum(mapping.ends_at_s > now_s for mapping in self._by_port.values())

    def _lets_in(self, mapping: _Mapping, remote: Endpoint, now_s: float) -> bool:
        if self.kind == "full-cone":
            return True
        known = (one for one, ends_at_s in mapping.spoken_to.items() if ends_at_s > now_s)
        if self.kind == "address-restricted":
            return any(host == remote[0] for host, _ in known)
        return remote in known

    def _free_port(self, now_s: float) -> int | None:
        count = len(self._all_ports)
        start = self._choose(count)
        for step in range(count):
            port = self._all_ports[(start + step) % count]
            mapping = self._by_port.get(port)
            if mapping is not None and mapping.ends_at_s <= now_s:
                self._forget(port)
            if port not in self._by_port:
                return port
        return None

    def _forget(self, port: int) -> None:
        mapping = self._by_port.pop(port)
        del self._ports[mapping.inside, mapping.destination]
