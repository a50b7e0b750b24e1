"""Judges what the addresses of a machine are worth for a peer connection, and which of a server's name are worth a
try."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Sequence
from itertools import chain, zip_longest
from typing import Literal

MAX_ADDRESSES = 4
"""Two of each family: a pair of servers behind one name, over IPv4 and IPv6."""


def tried_addresses(found: Sequence[str]) -> list[str]:
    """Up to :data:`MAX_ADDRESSES` of ``found``, the families in turn, each in the order of the name server."""
    known = list(dict.fromkeys(found))
    families = ([one for one in known if ":" in one], [one for one in known if ":" not in one])
    if known and ":" not in known[0]:
        families = families[::-1]
    return [one for one in chain.from_iterable(zip_longest(*families)) if one is not None][:MAX_ADDRESSES]


AddressKind = Literal["loopback", "link-local", "private", "shared", "public", "unique-local"]

_SHARED = ipaddress.ip_network("100.64.0.0/10")
"""Carrier-grade NAT (RFC 6598), also used by overlay networks."""
_UNIQUE_LOCAL = ipaddress.ip_network("fc00::/7")


def address_kind(host: str) -> AddressKind:
    """The kind of one IP address; raises :class:`ValueError` for a text that is none."""
    address = ipaddress.ip_address(host.partition("%")[0])
    if address.is_loopback:
        return "loopback"
    if address.is_link_local:
        return "link-local"
    if address in _SHARED:
        return "shared"
    if address in _UNIQUE_LOCAL:
        return "unique-local"
    return "private" if address.is_private else "public"


def addresses_verdict(hosts: Iterable[str]) -> tuple[str, str]:
    """The reason code (``check.ok`` where nothing is missing) and a sentence about a machine's addresses."""
    kinds = {host: address_kind(host) for host in hosts}
    usable = {host: kind for host, kind in kinds.items() if kind != "loopback"}
    if not usable:
        return "ice.no_address", "No network address but loopback."
    if all(kind == "link-local" for kind in usable.values()):
        return "ice.link_local_only", f"Link-local addresses only: {', '.join(sorted(usable))}."
    told = ", ".join(f"{host} ({kind})" for host, kind in usable.items() if kind != "link-local")
    if not any(":" not in host and kind != "link-local" for host, kind in usable.items()):
        return "ice.no_ipv4", f"IPv6 only: {told}."
    return "check.ok", f"Addresses: {told}."
