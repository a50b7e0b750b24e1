"""The STUN and TURN servers that a server hands to this robot: known, known to be none, or unknown, and why."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from mosaic_core.words.ice import IceServer


@dataclass(frozen=True, slots=True)
class Issued:
    """STUN and TURN servers. ``unknown_because``: why nobody knows which; that there are none is something else."""

    servers: tuple[IceServer, ...] = ()
    unknown_because: str = ""


NO_SERVER = Issued(unknown_because="No server is known, so neither are the STUN and TURN servers that it hands out.")
NOT_ASKED = Issued(
    unknown_because="Which STUN and TURN servers the server hands out is unknown: it could not be asked, or did not "
    "tell; see what is said of the server."
)
NO_ROBOT = Issued(
    unknown_because="Which STUN and TURN servers the server hands out it tells its robots only: name the robot's "
    "YAML file."
)


class IssuedIceServers:
    """The ICE servers that the server hands to this robot; whoever probes them waits until that is known, or never will
    be."""

    def __init__(self) -> None:
        self._settled: asyncio.Future[Issued] = asyncio.get_running_loop().create_future()

    def settle(self, issued: Issued) -> None:
        """The first word counts."""
        if not self._settled.done():
            self._settled.set_result(issued)

    async def wait(self) -> Issued:
        return await self._settled
