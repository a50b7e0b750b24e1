"""As what an address counts: whoever has one IPv6 address has its whole /64 to choose from (RFC 6177)."""

from __future__ import annotations

from ipaddress import IPv6Network, ip_address


def counted_address(address: str) -> str:
    """IPv4 as it is (also when it is written as IPv6), IPv6 as its /64, anything else as it is."""
    try:
        known = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if known.version == 4:
        return str(known)
    if known.ipv4_mapped is not None:
        return str(known.ipv4_mapped)
    return str(IPv6Network((known, 64), strict=False))
