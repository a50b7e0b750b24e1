"""All servers that introduce operators to one robot, together: each may come and go, the robot goes on."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.runtime.observation.counters import ServerSnapshot
from mosaic_core.runtime.signaling.server_link import KnownServer, PeerStarter, ServerLink
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.errors import SignalingError


class RobotServers:
    """Keeps a link to every server of a robot. Event loop only."""

    def __init__(
        self,
        servers: Sequence[KnownServer],
        catalogue: Catalogue,
        peers: PeerStarter,
        state_changed: Callable[[], None],
    ) -> None:
        scopes = [f"{one.name}:" if len(servers) > 1 else "" for one in servers]
        self.links = tuple(
            ServerLink(one, catalogue, scope, peers, state_changed) for one, scope in zip(servers, scopes, strict=True)
        )

    @property
    def state(self) -> str:
        """How the robot stands to the server to which it stands best."""
        return best_state([link.state for link in self.links])

    @property
    def error(self) -> SignalingError | None:
        """Why a server put the robot off for good; of several the last one's."""
        return next((link.error for link in reversed(self.links) if link.error is not None), None)

    async def run(self) -> None:
        """Until every server has put the robot off for good, or :meth:`shut_down`."""
        await asyncio.gather(*(link.run() for link in self.links))

    def shut_down(self) -> None:
        for link in self.links:
            link.shut_down()

    def network_changed(self, change: NetworkChange) -> None:
        for link in self.links:
            link.network_changed(change)

    def snapshot(self) -> tuple[ServerSnapshot, ...]:
        return tuple(ServerSnapshot(link.server.name, link.server.config.ws_url, link.state) for link in self.links)


def best_state(states: Sequence[str]) -> str:
    """Of several servers' states the best."""
    return next((one for one in ("ready", "connecting", "offline") if one in states), "stopped")
