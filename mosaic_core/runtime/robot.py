"""The robot: its handlers run, its peers come and go, its servers are there or not; each goes on without the others."""

from __future__ import annotations

import asyncio
import logging
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass

import pluggy

from mosaic_core.contract.configurer import Shared
from mosaic_core.contract.host import Sender
from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.hook_calls import call_hook
from mosaic_core.runtime.control.robot_control import RobotControl
from mosaic_core.runtime.delivery.sessions import SessionBook
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.observation.counters import RobotSnapshot
from mosaic_core.runtime.observation.delivery_reports import DeliveryReports
from mosaic_core.runtime.peers.near_path import NearPath
from mosaic_core.runtime.peers.peer_book import PeerBook
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.signaling.robot_servers import RobotServers
from mosaic_core.runtime.signaling.server_link import FLEET, KnownServer
from mosaic_core.runtime.transport.picture_transport import PictureStreamFactory
from mosaic_core.runtime.transport.sound_transport import SoundStreamFactory
from mosaic_core.runtime.transport.transport import AnswererFactory, NetworkWatcher, SocketConnector
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import RobotConfig

logger = logging.getLogger(__name__)

_PEERS_PATIENCE_S = 1.0
"""For the peers' transports and the socket to close at the end."""


@dataclass(frozen=True, slots=True)
class _Live:
    """What a robot has once it runs."""

    runs: HandlerRuns
    control: RobotControl
    sessions: SessionBook
    peers: PeerBook
    servers: RobotServers


class Robot:
    """Is ``run`` on an event loop until ``stop``. One robot runs once."""

    def __init__(
        self,
        config: RobotConfig,
        connectors: Sequence[Connector],
        *,
        shared: Shared,
        plugins: pluggy.PluginManager,
        connect_socket: SocketConnector,
        make_answerer: AnswererFactory,
        open_stream: PictureStreamFactory,
        open_sound: SoundStreamFactory = plain_sound,
        software: str,
        lan: KnownServer | None = None,
        watch_network: NetworkWatcher | None = None,
    ) -> None:
        """``lan`` is a second server beside that of the configuration, or the only one where it names none."""
        self._config = config
        self._connectors = tuple(connectors)
        self._shared = shared
        self._plugins = plugins
        self._known_servers = _known_servers(config, connect_socket, lan)
        self._make_answerer = make_answerer
        self._open_stream = open_stream
        self._open_sound = open_sound
        self._software = software
        self._watch_network = watch_network
        self._catalogue = Catalogue.of(connector.entry for connector in connectors)
        self._state = "offline"
        self._started_at_s = time.monotonic()
        self._near = NearPath()
        self._live: _Live | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop_wanted = False
        self._stopping = asyncio.Event()

    @property
    def robot_id(self) -> str:
        return self._known_servers[0].robot_id

    @property
    def state(self) -> str:
        """``connecting``, ``ready``, ``offline`` or ``stopped``: the relation to the server, of several the best."""
        return self._state

    @property
    def catalogue(self) -> Catalogue:
        return self._catalogue

    @property
    def peers(self) -> tuple[Sender, ...]:
        """The operators whose peer connection is up."""
        return self._live.peers.connected() if self._live is not None else ()

    @property
    def _running(self) -> _Live:
        assert self._live is not None
        return self._live

    # -- life ----------------------------------------------------------------------------------------------------

    async def run(self) -> None:
        """Run until :meth:`stop`. Raises :class:`SignalingError` (``signal.replaced``) if the same robot connected
        elsewhere and no other server is left, and whatever a shared thing of the plugins raises when it is entered."""
        self._loop = asyncio.get_running_loop()
        shared = await asyncio.to_thread(self._shared.entered)
        try:
            await self._run()
        finally:
            await asyncio.to_thread(shared.close)
        error = self._running.servers.error
        if error is not None and not self._stop_wanted:
            raise error

    async def _run(self) -> None:
        self._live = live = self._built()
        live.runs.start()
        signaling = asyncio.create_task(live.servers.run(), name="mosaic-signaling")
        signaling.add_done_callback(lambda _: self._stopping.set())
        watching = None
        if self._watch_network is not None:
            watching = asyncio.create_task(self._watch_network(self._network_changed), name="mosaic-network")
        try:
            if not self._stop_wanted:
                await self._stopping.wait()
        finally:
            if watching is not None:
                watching.cancel()
            await self._shutdown(live, signaling)
        if not signaling.cancelled() and (bug := signaling.exception()) is not None:
            raise bug

    def _built(self) -> _Live:
        links = LinkWatch()
        runs = HandlerRuns(self._connectors, self._open_stream, self, links, self._open_sound)
        control = RobotControl(self._config.control, runs.routes, runs.safety, links, self)
        sessions = SessionBook(runs.outbox, lambda label: runs.routes[label].counters)
        site = Site(
            routes=runs.routes,
            outbox=runs.outbox,
            sessions=sessions,
            media=runs.media,
            talk=runs.talk,
            desk=control.desk,
            links=links,
            near=self._near,
            delivery=DeliveryReports(lambda: runs.snapshot({})),
            legacy_peers=self._config.control.legacy_peers,
            catalogue=self._catalogue,
            boot_id=uuid.uuid4().hex,
            software=self._software,
            listener=self,
        )
        peers = PeerBook(site, self._make_answerer)
        servers = RobotServers(self._known_servers, self._catalogue, peers, self._server_changed)
        return _Live(runs, control, sessions, peers, servers)

    def _network_changed(self, change: NetworkChange) -> None:
        """Be found again soon: operators whose connection is dead ask for a new one through the server."""
        logger.info("this machine's network is another one (%s)", change)
        self._running.servers.network_changed(change)
        if change == "moved":
            for peer in self._running.peers:
                peer.doubt()

    def stop(self) -> None:
        """Begin an orderly end. Any thread, any number of times, also before :meth:`run`."""
        self._stop_wanted = True
        if self._loop is None:
            return
        try:
            self._loop.call_soon_threadsafe(self._stopping.set)
        except RuntimeError:
            logger.debug("stop() after the robot's event loop was closed")

    async def _shutdown(self, live: _Live, signaling: asyncio.Task[None]) -> None:
        live.peers.close_all("peer.shutdown")
        live.sessions.close()
        live.servers.shut_down()
        handlers = asyncio.create_task(live.runs.close())
        _, late = await asyncio.wait({signaling, asyncio.create_task(live.peers.closed())}, timeout=_PEERS_PATIENCE_S)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
        await handlers
        await live.control.close()

    # -- what servers tell ---------------------------------------------------------------------------------------

    def _server_changed(self) -> None:
        state = self._running.servers.state
        if state != self._state:
            self._state = state
            call_hook(self._plugins, "mosaic_robot_state_changed", state=state)

    def near_changed(self, urls: Sequence[str]) -> None:
        """Where the robot serves operators on its own network now; those who came another way hear of it."""
        self._near.urls_changed(urls)

    # -- what peers tell -----------------------------------------------------------------------------------------

    def peer_connected(self, sender: Sender) -> None:
        self._running.control.peer_connected(sender)
        call_hook(self._plugins, "mosaic_peer_connected", sender=sender)

    def peer_closed(self, sender: Sender, code: str, message: str) -> None:
        self._running.control.peer_closed(sender, code, message)
        call_hook(self._plugins, "mosaic_peer_closed", sender=sender, code=code)

    def lease_changed(self, resource: str, holder: Sender | None, epoch: int, cause: str) -> None:
        arguments = {"resource": resource, "holder": holder, "epoch": epoch, "cause": cause}
        call_hook(self._plugins, "mosaic_lease_changed", **arguments)

    def stop_changed(self, is_stopped: bool, by: str, reason: str) -> None:
        call_hook(self._plugins, "mosaic_stop_changed", is_stopped=is_stopped, by=by, reason=reason)

    def command_refused(self, label: str, sender: Sender, code: str) -> None:
        self._running.control.journal.refused(label, sender, code)
        call_hook(self._plugins, "mosaic_command_received", label=label, sender=sender, accepted=False, code=code)

    # -- what handlers tell --------------------------------------------------------------------------------------

    def command_done(self, outcome: Outcome) -> None:
        item = outcome.item
        if outcome.code:
            peer = self._running.peers.get(item.sender.peer_id)
            if peer is not None:
                peer.operator.refuse(item.channel, item.seq, outcome.code, outcome.message)
        self._running.control.command_done(outcome)
        arguments = {"label": item.channel, "sender": item.sender, "accepted": not outcome.code, "code": outcome.code}
        call_hook(self._plugins, "mosaic_command_received", **arguments)

    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        call_hook(self._plugins, "mosaic_connector_failed", label=label, error=error, restart_in_s=restart_in_s)

    def talking_changed(self, label: str, who: Sender | None) -> None:
        for peer in self._running.peers:
            peer.media.talking_changed(label, who)

    # -- the live table ------------------------------------------------------------------------------------------

    def snapshot(self) -> RobotSnapshot:
        """The robot now. Event loop."""
        uptime_s, live = time.monotonic() - self._started_at_s, self._live
        if live is None:
            return RobotSnapshot(self.robot_id, self._state, uptime_s, (), ())
        return RobotSnapshot(
            robot_id=self.robot_id,
            state=self._state,
            uptime_s=uptime_s,
            connectors=live.runs.snapshot(live.control.limit_factors),
            peers=live.peers.snapshot(),
            leases=live.control.leases(),
            stop=live.control.stop_snapshot(),
            servers=live.servers.snapshot(),
        )


def _known_servers(
    config: RobotConfig, connect_socket: SocketConnector, lan: KnownServer | None
) -> tuple[KnownServer, ...]:
    own = () if config.server is None else (KnownServer(FLEET, config.server, connect_socket),)
    servers = own if lan is None else (*own, lan)
    if not servers:
        raise ValueError("a robot needs a server: its configuration names none")
    return servers
