"""The network of this machine: its addresses, and its changes, long before a silent connection would tell."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import time
from collections.abc import Callable

import ifaddr

from mosaic_core.machines.peers.network_change import NetworkChange, NetworkView, change_between

PERIOD_S = 0.2
"""Looking costs a fraction of a millisecond; a loss of connection would tell after two seconds."""
_STRANGERS = ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1"))
"""Addresses for documentation (RFC 5737, RFC 3849): nothing is sent there, the system only chooses a way."""


async def watch_network(changed: Callable[[NetworkChange], None]) -> None:
    """Call ``changed`` on the event loop at every change, until cancelled."""
    before = network_view()
    while True:
        await asyncio.sleep(PERIOD_S)
        now = network_view()
        change = change_between(before, now)
        before = now
        if change is not None:
            changed(change)


def network_view() -> NetworkView:
    ways = tuple(_way_out(*stranger) for stranger in _STRANGERS)
    return NetworkView(frozenset(filter(_leads_somewhere, all_addresses())), ways, _slept_s())


def host_addresses() -> list[str]:
    """Those that ICE offers: without loopback, and without IPv6 addresses that need an interface's name."""
    import aioice.ice  # only now: a robot that nobody looks at holds nothing of WebRTC

    return list(aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True))


def all_addresses() -> list[str]:
    """Every address, IPv6 without its scope; loopback too."""
    return [str(ip.ip if isinstance(ip.ip, str) else ip.ip[0]) for one in ifaddr.get_adapters() for ip in one.ips]


def _leads_somewhere(address: str) -> bool:
    """Nothing of ours is connected from loopback or link-local addresses to anywhere else."""
    ip = ipaddress.ip_address(address)
    return not (ip.is_loopback or ip.is_link_local)


def _way_out(family: socket.AddressFamily, stranger: str) -> str | None:
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((stranger, 9))
            return str(probe.getsockname()[0])
    except OSError:
        return None


def _slept_s() -> float:
    """Only Linux tells the two clocks apart."""
    if not hasattr(time, "CLOCK_BOOTTIME"):
        return 0.0
    return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)
