"""Announces the server on all networks of this machine as ``_mosaic._tcp`` (DNS-SD over mDNS, RFC 6763), no secrets."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mosaic_core.words.lan import SERVICE_TYPE
from mosaic_server.lan.addresses import mdns_label

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncServiceInfo, AsyncZeroconf

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Announced:
    """The facts about a server that everybody on the network may know. ``fingerprint``: SHA-256 of the TLS certificate,
    empty over http."""

    name: str
    robot_id: str
    port: int
    scheme: str
    version: str
    fingerprint: str = ""

    @property
    def hostname(self) -> str:
        """``rover.local``"""
        return f"{mdns_label(self.name) or 'mosaic'}.local"

    def properties(self) -> dict[str, str]:
        """The TXT record."""
        known = {
            "txtvers": "1", "id": self.robot_id, "name": self.name[:100], "path": "/", "scheme": self.scheme,
            "version": self.version, "fingerprint": self.fingerprint,
        }  # fmt: skip
        return {key: value for key, value in known.items() if value}


class Announcement:
    """Announces the server from :meth:`show` to :meth:`withdraw`. Event loop only. Without the package ``zeroconf`` it
    does nothing.
    """

    def __init__(self, announced: Announced) -> None:
        self._announced = announced
        self._zeroconf: AsyncZeroconf | None = None
        self._info: AsyncServiceInfo | None = None
        self.is_possible = _is_installed()

    @property
    def hostname(self) -> str:
        """Under which the addresses are announced; empty where nothing is."""
        return self._announced.hostname if self.is_possible else ""

    async def show(self, addresses: Sequence[str]) -> None:
        """Announce these addresses in place of the ones before; none: nothing."""
        if not self.is_possible:
            return
        await self.withdraw()
        if not addresses:
            return
        from zeroconf import IPVersion, NonUniqueNameException
        from zeroconf.asyncio import AsyncZeroconf

        try:
            # A new one each time: its sockets belong to the interfaces that were there when it was made.
            version = IPVersion.V6Only if ":" in addresses[0] else IPVersion.V4Only
            self._zeroconf = AsyncZeroconf(interfaces=list(addresses), ip_version=version)
            self._info = _service(self._announced, addresses)
            await (await self._zeroconf.async_register_service(self._info, allow_name_change=True))
        except (OSError, NonUniqueNameException) as error:
            _log.warning("this robot can't be announced over mDNS: %s", error or type(error).__name__)
            await self.withdraw()

    async def withdraw(self) -> None:
        """Tell everybody that it is gone."""
        zeroconf, self._zeroconf, self._info = self._zeroconf, None, None
        if zeroconf is not None:
            await zeroconf.async_close()


def _service(announced: Announced, addresses: Sequence[str]) -> AsyncServiceInfo:
    from zeroconf.asyncio import AsyncServiceInfo

    # A dot would begin a new label, and 63 bytes are the most that one may have.
    label = announced.name.replace(".", " ").encode()[:63].decode(errors="ignore").strip() or "robot"
    return AsyncServiceInfo(
        SERVICE_TYPE,
        f"{label}.{SERVICE_TYPE}",
        port=announced.port,
        properties=announced.properties(),
        server=f"{announced.hostname}.",
        parsed_addresses=list(addresses),
    )


def _is_installed() -> bool:
    try:
        import zeroconf  # noqa: F401
    except ImportError:
        _log.warning('not announced on this network; to be found by name: pip install "mosaic-server[lan]"')
        return False
    return True
