"""Holds what a robot has while it runs: handlers, who commands it, its peers and its servers, each built on those
before."""

from __future__ import annotations

import asyncio
import logging
import uuid
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.control.command_desk import DeskListener
from mosaic_core.runtime.control.robot_control import RobotControl
from mosaic_core.runtime.delivery.sessions import SessionBook
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns, RunsListener
from mosaic_core.runtime.observation.delivery_reports import DeliveryReports
from mosaic_core.runtime.peers.connector_change import route_change, takes_ways
from mosaic_core.runtime.peers.near_path import NearPath
from mosaic_core.runtime.peers.peer_book import PeerBook
from mosaic_core.runtime.peers.site import PeerListener, RouteChange, Site
from mosaic_core.runtime.signaling.server_link import KnownServer, RobotServers
from mosaic_core.runtime.threads.loop_guard import LoopBlock, LoopGuard
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory
from mosaic_core.runtime.transport.transport import AnswererFactory
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import RobotConfig

logger = logging.getLogger(__name__)

SharedChange: TypeAlias = Callable[[], Awaitable[None]]
"""Leaves what only retired connectors shared, and enters what the new ones do."""
_PEERS_PATIENCE_S = 1.0
"""For the peers' transports and the socket to close at the end."""


@dataclass(frozen=True, slots=True)
class RobotPlan:
    """The parts that a robot is made of."""

    config: RobotConfig
    connectors: tuple[Connector, ...]
    catalogue: Catalogue
    servers: tuple[KnownServer, ...]
    make_answerer: AnswererFactory
    open_stream: PictureStreamFactory
    open_sound: SoundStreamFactory
    software: str


class LiveListener(RunsListener, DeskListener, PeerListener, Protocol):
    """Hears all that happens on a running robot, on the event loop."""

    def server_changed(self) -> None:
        """The robot stands to a server in another way than before."""

    def loop_blocked(self, block: LoopBlock) -> None:
        """Something held up the event loop, and is over."""


class LiveRobot:
    """Holds what runs, and ends it in order. Made on the event loop when the robot starts; event loop only."""

    def __init__(self, plan: RobotPlan, near: NearPath, listener: LiveListener) -> None:
        links = LinkWatch()
        self.runs = runs = HandlerRuns(plan.connectors, plan.open_stream, listener, links, plan.open_sound)
        self._connectors = plan.connectors
        self.control = RobotControl(plan.config.control, runs.routes, runs.safety, links, listener)
        self._sessions = SessionBook(runs.outbox, lambda label: runs.routes[label].counters)
        self.site = site = Site(
            routes=runs.routes,
            outbox=runs.outbox,
            sessions=self._sessions,
            media=runs.media,
            talk=runs.talk,
            desk=self.control.desk,
            links=links,
            near=near,
            delivery=DeliveryReports(lambda: runs.snapshot({})),
            legacy_peers=plan.config.control.legacy_peers,
            catalogue=plan.catalogue,
            boot_id=uuid.uuid4().hex,
            software=plan.software,
            listener=listener,
        )
        self.guard = LoopGuard(runs.handlers, listener.loop_blocked)
        self.peers = PeerBook(site, plan.make_answerer)
        self.servers = RobotServers(plan.servers, plan.catalogue, self.peers, listener.server_changed)

    async def become(self, connectors: Sequence[Connector], shared: SharedChange) -> None:
        """Have other connectors: those that are not the same objects as before end, and what they move is made safe
        first; ``shared`` is changed between the old and the new ones. Operators stay, and hear of the new catalogue."""
        before, kept = self._connectors, {id(one) for one in connectors}
        gone = [one for one in before if id(one) not in kept]
        was = {one.config.label: one for one in gone}
        fresh = [one for one in connectors if id(one) not in {id(old) for old in before}]
        replaced = {label: was[label] for one in fresh if takes_ways(was.get(label := one.config.label), one)}
        await self.runs.retire(gone)
        await shared()
        self.runs.become(connectors, replaced)
        self._connectors = tuple(connectors)
        self.guard.watch(self.runs.handlers)
        self.control.connectors_changed()
        self._tell(route_change(gone, fresh, replaced))

    def _tell(self, change: RouteChange) -> None:
        catalogue = Catalogue.of(entry for connector in self._connectors for entry in connector.entries)
        is_news = catalogue != self.site.catalogue
        self.site.catalogue = catalogue
        self.peers.connectors_changed(replace(change, is_news=is_news))
        if is_news:
            self.servers.catalogue_changed(catalogue)

    def network_changed(self, change: NetworkChange) -> None:
        """Be found again soon: operators whose connection is dead ask for a new one through the server."""
        logger.info("this machine's network is another one (%s)", change)
        self.servers.network_changed(change)
        if change == "moved":
            for peer in self.peers:
                peer.doubt()

    async def end(self, signaling: asyncio.Task[None]) -> None:
        """Say good-bye to operators and servers, stop what moves, then the rest. ``signaling`` runs the servers."""
        self.guard.stop()
        self.peers.close_all("peer.shutdown")
        self._sessions.close()
        self.servers.shut_down()
        handlers = asyncio.create_task(self.runs.close())
        _, late = await asyncio.wait({signaling, asyncio.create_task(self.peers.closed())}, timeout=_PEERS_PATIENCE_S)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
        await handlers
        await self.control.close()
