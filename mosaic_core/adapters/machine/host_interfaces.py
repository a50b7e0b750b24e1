"""The network addresses of this machine, as ICE sees them."""

from __future__ import annotations

import aioice.ice
import ifaddr


def host_addresses() -> list[str]:
    """Those that ICE offers: without loopback, and without IPv6 addresses that need an interface's name."""
    return list(aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True))


def all_addresses() -> list[str]:
    """Every address, IPv6 without its scope; loopback too."""
    return [str(ip.ip if isinstance(ip.ip, str) else ip.ip[0]) for one in ifaddr.get_adapters() for ip in one.ips]
