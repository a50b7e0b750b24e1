"""Tells which kind of NAT stands between a machine and the network, from what STUN servers say they see (RFC 5780
§4.3).

One socket asks several servers. If all see the same address and port, a peer can use that as well; if each sees
another port, none of them is of use to a third.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from mosaic_core.machines.laboratory.nat import Endpoint

NatMapping = Literal["none", "endpoint-independent", "symmetric", "unknown", "blocked"]


@dataclass(frozen=True, slots=True)
class Mapping:
    """The address mapping that one STUN server saw: ``server`` is where the question went, ``mapped`` how it saw us."""

    server: Endpoint
    mapped: Endpoint


@dataclass(frozen=True, slots=True)
class NatVerdict:
    """The kind, and why. ``keeps_port``: the outer port is the inner one."""

    kind: NatMapping
    sentence: str
    public_hosts: tuple[str, ...] = ()
    keeps_port: bool | None = None


def nat_verdict(local_port: int, local_hosts: Collection[str], mappings: Sequence[Mapping]) -> NatVerdict:
    """Judge the answers that one socket, bound to ``local_port`` of a machine with ``local_hosts``, got."""
    if not mappings:
        return NatVerdict("blocked", "No STUN server answered: UDP may be blocked here, or none is reachable.")
    seen = {one.mapped for one in mappings}
    hosts = tuple(sorted({host for host, _ in seen}))
    keeps_port = all(port == local_port for _, port in seen)
    where = " and ".join(hosts)
    if all(host in local_hosts for host in hosts) and keeps_port:
        return NatVerdict("none", f"No NAT: the network sees this machine's own address {where}.", hosts, True)
    if len(seen) > 1:
        what = "address" if len(hosts) > 1 else "port"
        text = f"Symmetric NAT: each STUN server sees another {what} ({_shown(seen)})."
        return NatVerdict("symmetric", text, hosts, keeps_port)
    if len({one.server for one in mappings}) < 2:
        text = f"NAT, seen from outside as {where}; a second STUN server would tell of what kind."
        return NatVerdict("unknown", text, hosts, keeps_port)
    text = f"NAT with one port for all destinations (endpoint-independent), seen from outside as {where}."
    return NatVerdict("endpoint-independent", text, hosts, keeps_port)


def _shown(seen: Collection[Endpoint]) -> str:
    return ", ".join(f"[{host}]:{port}" if ":" in host else f"{host}:{port}" for host, port in sorted(seen))
