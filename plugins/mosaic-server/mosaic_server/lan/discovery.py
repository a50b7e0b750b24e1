"""Finds the robots that announce themselves on this network."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mosaic_core.words.errors import MosaicError
from mosaic_core.words.lan import SERVICE_TYPE
from mosaic_server.lan.addresses import url_of

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncZeroconf

RESOLVE_MS = 2000


@dataclass(frozen=True, slots=True)
class FoundRobot:
    """A robot that was found by its announcement. ``urls``: by address, then by name."""

    name: str
    robot_id: str
    urls: tuple[str, ...]
    version: str
    fingerprint: str


async def found_robots(for_s: float, interfaces: list[str] | None = None) -> list[FoundRobot]:
    """Who answers within ``for_s``, by name. Raises :class:`MosaicError` without ``zeroconf`` or a network."""
    try:
        from zeroconf import InterfaceChoice, ServiceStateChange, Zeroconf
        from zeroconf.asyncio import AsyncServiceBrowser, AsyncZeroconf
    except ImportError:
        message = "robots are looked for with the package zeroconf, which is not installed"
        raise MosaicError(message, code="config.lan", cure='pip install "mosaic-server[lan]"') from None
    names: set[str] = set()

    def changed(zeroconf: Zeroconf, service_type: str, name: str, state_change: ServiceStateChange) -> None:
        (names.discard if state_change is ServiceStateChange.Removed else names.add)(name)

    try:
        zeroconf = AsyncZeroconf(interfaces=interfaces or InterfaceChoice.All)
    except OSError as error:
        raise MosaicError(f"this machine has no network to look on: {error}", code="config.lan", cure="") from error
    try:
        browser = AsyncServiceBrowser(zeroconf.zeroconf, SERVICE_TYPE, handlers=[changed])
        await asyncio.sleep(for_s)
        await browser.async_cancel()
        found = await asyncio.gather(*(_resolved(zeroconf, name) for name in sorted(names)))
    finally:
        await zeroconf.async_close()
    return sorted((one for one in found if one is not None), key=lambda one: (one.name, one.robot_id))


async def _resolved(zeroconf: AsyncZeroconf, name: str) -> FoundRobot | None:
    """``None``: it went away, or it is something else under our name."""
    info = await zeroconf.async_get_service_info(SERVICE_TYPE, name, RESOLVE_MS)
    if info is None or info.port is None:
        return None
    words = {key: value or "" for key, value in info.decoded_properties.items()}
    scheme = "https" if words.get("scheme") == "https" else "http"
    hosts = [*info.parsed_addresses(), *([info.server.rstrip(".")] if info.server else [])]
    urls = tuple(url_of(scheme, host, info.port) for host in hosts)
    label = name.removesuffix(f".{SERVICE_TYPE}")
    return FoundRobot(
        words.get("name") or label, words.get("id", ""), urls, words.get("version", ""), words.get("fingerprint", "")
    )
