"""Searches this network for robots that announce themselves, by mDNS."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mosaic_core.machines.lan.announced_robots import MOST_ROBOTS, AnnouncedRobot, announced_robot
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.lan import SERVICE_TYPE

if TYPE_CHECKING:
    from zeroconf import Zeroconf
    from zeroconf.asyncio import AsyncZeroconf

_RESOLVE_MS = 2000


async def announced_robots(for_s: float, interfaces: Sequence[str] | None = None) -> list[AnnouncedRobot]:
    """The robots that answer within ``for_s``, by name; it ends two seconds later at the latest.
    ``interfaces``: addresses of this machine, by default all of them.

    Raises :class:`SignalingError` (``lan.search``) without the package ``zeroconf`` or a network.
    """
    try:
        from zeroconf import InterfaceChoice, ServiceStateChange
        from zeroconf.asyncio import AsyncServiceBrowser, AsyncZeroconf
    except ImportError:
        message = "robots are searched for with the package zeroconf, which is not installed"
        raise SignalingError(message, code="lan.search") from None
    names: set[str] = set()

    def changed(zeroconf: Zeroconf, service_type: str, name: str, state_change: ServiceStateChange) -> None:
        if state_change is ServiceStateChange.Removed:
            names.discard(name)
        elif len(names) < MOST_ROBOTS:
            names.add(name)

    try:
        zeroconf = AsyncZeroconf(interfaces=list(interfaces) if interfaces else InterfaceChoice.All)
    except OSError as error:
        message = f"this machine has no network to search: {error}"
        raise SignalingError(message, code="lan.search", cure="Connect it to the robot's network.") from error
    try:
        browser = AsyncServiceBrowser(zeroconf.zeroconf, SERVICE_TYPE, handlers=[changed])
        await asyncio.sleep(for_s)
        await browser.async_cancel()
        found = await asyncio.gather(*(_resolved(zeroconf, name) for name in sorted(names)))
    finally:
        await zeroconf.async_close()
    return sorted((one for one in found if one is not None), key=lambda one: (one.name, one.robot_id))


async def _resolved(zeroconf: AsyncZeroconf, service: str) -> AnnouncedRobot | None:
    """``None``: it went away, or it is something else under our name."""
    info = await zeroconf.async_get_service_info(SERVICE_TYPE, service, _RESOLVE_MS)
    if info is None:
        return None
    hosts = [*info.parsed_addresses(), *([info.server.rstrip(".")] if info.server else [])]
    return announced_robot(service, info.decoded_properties, hosts, info.port)
