"""Proxies that were named: they alone may say for whom they speak."""

from __future__ import annotations

from collections.abc import Iterable
from ipaddress import IPv4Network, IPv6Network, ip_address, ip_interface, ip_network

IpNetwork = IPv4Network | IPv6Network


def proxy_in(text: str) -> str:
    """An address or network of proxies, as it is compared later; raises ``ValueError`` with the cure."""
    try:
        return str(ip_network(text)) if "/" in text else str(ip_address(text))
    except ValueError:
        pass
    try:
        wanted = ip_interface(text).network
    except ValueError:
        raise ValueError(f"{text!r} is no address: write for example 127.0.0.1 or 10.0.0.0/8") from None
    raise ValueError(f"{text!r} is an address inside of a network: write {wanted}")


class TrustedProxies:
    """Knows the addresses of the named proxies."""

    def __init__(self, named: Iterable[str]) -> None:
        self._networks: list[IpNetwork] = [ip_network(one) for one in named]

    def __contains__(self, address: object) -> bool:
        try:
            known = ip_address(str(address).partition("%")[0])
        except ValueError:
            return False
        return any(known in network for network in self._networks)
