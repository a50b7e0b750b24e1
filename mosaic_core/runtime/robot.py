"""The robot: its handlers run, its peers come and go, its servers are there or not; each goes on without the others."""

from __future__ import annotations

import asyncio
import logging
import time
import uuid
from collections.abc import Sequence

import pluggy

from mosaic_core.contract.configurer import Shared
from mosaic_core.contract.host import Sender
from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.machines.signaling import signaling_events as session
from mosaic_core.machines.signaling.peer_admission import AddCandidate, RefusePeer, RenegotiatePeer, StartPeer, StopPeer
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.hook_calls import call_hook
from mosaic_core.runtime.control.robot_control import RobotControl
from mosaic_core.runtime.delivery.sessions import SessionBook
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.observation.counters import PeerSnapshot, RobotSnapshot, ServerSnapshot
from mosaic_core.runtime.observation.delivery_reports import DeliveryReports
from mosaic_core.runtime.peers.near_path import NearPath
from mosaic_core.runtime.peers.peer import Peer
from mosaic_core.runtime.peers.site import RobotPeer, Site
from mosaic_core.runtime.signaling.server_link import FLEET, LAN, KnownServer, ServerLink, best_state
from mosaic_core.runtime.transport.picture_transport import PictureStreamFactory
from mosaic_core.runtime.transport.sound_transport import SoundStreamFactory
from mosaic_core.runtime.transport.transport import AnswererFactory, NetworkWatcher, SocketConnector
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import reason
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import SignalingMessage

logger = logging.getLogger(__name__)

_PEERS_PATIENCE_S = 1.0
"""For the peers' transports and the socket to close at the end."""


class Robot:
    """``run`` on an event loop until ``stop``. One robot runs once."""

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
        self._servers = _servers(config, connect_socket, lan)
        self._make_answerer = make_answerer
        self._open_stream = open_stream
        self._open_sound = open_sound
        self._software = software
        self._watch_network = watch_network
        self._catalogue = Catalogue.of(connector.entry for connector in connectors)
        self._state = "offline"
        self._started_at_s = time.monotonic()
        self._peers: dict[str, Peer] = {}
        self._closing: set[RobotPeer] = set()
        self._newest_ice_servers: Sequence[IceServer] = ()
        self._runs: HandlerRuns | None = None
        self._site: Site | None = None
        self._control: RobotControl | None = None
        self._links: tuple[ServerLink, ...] = ()
        self._near = NearPath(lambda peer_id: self._link_of(peer_id).server.name == LAN)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop_wanted = False
        self._stopping = asyncio.Event()
        self._error: SignalingError | None = None

    @property
    def robot_id(self) -> str:
        return self._servers[0].robot_id

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
        return tuple(peer.sender for peer in self._peers.values() if peer.connected_at_s is not None)

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
        if self._error is not None and not self._stop_wanted:
            raise self._error

    async def _run(self) -> None:
        links = LinkWatch()
        self._runs = runs = HandlerRuns(self._connectors, self._open_stream, self, links, self._open_sound)
        self._control = RobotControl(self._config.control, runs.routes, runs.safety, links, self)
        self._site = Site(
            routes=runs.routes,
            outbox=runs.outbox,
            sessions=SessionBook(runs.outbox, lambda label: runs.routes[label].counters),
            media=runs.media,
            talk=runs.talk,
            desk=self._control.desk,
            links=links,
            near=self._near,
            delivery=DeliveryReports(lambda: runs.snapshot({})),
            legacy_peers=self._config.control.legacy_peers,
            catalogue=self._catalogue,
            boot_id=uuid.uuid4().hex,
            software=self._software,
            listener=self,
        )
        self._links = tuple(
            ServerLink(one, self._catalogue, self._scope(one), self._carry_out) for one in self._servers
        )
        runs.start()
        signaling = asyncio.create_task(self._introduce(), name="mosaic-signaling")
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
            await self._shutdown(runs, signaling)
        if not signaling.cancelled() and (bug := signaling.exception()) is not None:
            raise bug

    async def _introduce(self) -> None:
        """Until every server has put the robot off for good."""
        await asyncio.gather(*(link.run() for link in self._links))

    def _scope(self, server: KnownServer) -> str:
        return f"{server.name}:" if len(self._servers) > 1 else ""

    def _network_changed(self, change: NetworkChange) -> None:
        """Be found again soon: operators whose connection is dead ask for a new one through the server."""
        logger.info("this machine's network is another one (%s)", change)
        for link in self._links:
            link.network_changed(change)
        if change == "moved":
            for peer in tuple(self._peers.values()):
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

    async def _shutdown(self, runs: HandlerRuns, signaling: asyncio.Task[None]) -> None:
        for peer in tuple(self._peers.values()):
            peer.close("peer.shutdown")
        if self._site is not None:
            self._site.sessions.close()
        for link in self._links:
            link.shut_down()
        handlers = asyncio.create_task(runs.close())
        endings = [asyncio.create_task(peer.closed()) for peer in self._closing]
        _, late = await asyncio.wait({signaling, *endings}, timeout=_PEERS_PATIENCE_S)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
        await handlers
        if self._control is not None:
            await self._control.close()

    # -- effects of the signaling session ------------------------------------------------------------------------

    def _carry_out(self, effect: session.Effect) -> None:
        match effect:
            case StartPeer():
                self._start_peer(effect)
            case RenegotiatePeer(peer_id, offer_sdp, tracks):
                peer = self._peers.get(peer_id)
                if peer is not None:
                    peer.renegotiate(offer_sdp, tracks)
            case StopPeer(peer_id, code):
                # the session has forgotten it already: its end, told now, would end a new one under the same id
                peer = self._peers.pop(peer_id, None)
                if peer is not None:
                    peer.close(code)
            case AddCandidate(peer_id, candidate):
                peer = self._peers.get(peer_id)
                if peer is not None:
                    peer.add_candidate(candidate)
            case RefusePeer(peer_id, code, message):
                fields = {"peerId": peer_id, "code": code}
                logger.warning("operator refused (%s): %s", code, message or reason(code).sentence, extra=fields)
            case session.ChangeState():
                self._change_state(best_state([one.state for one in self._links]))
            case session.Report(code, message):
                self._report(code, message)

    def _start_peer(self, start: StartPeer) -> None:
        assert self._site is not None
        peer = Peer(start, self._site, self._make_answerer)
        self._peers[peer.peer_id] = peer
        self._newest_ice_servers = start.ice_servers
        peer.begin()

    def _change_state(self, state: str) -> None:
        if state != self._state:
            self._state = state
            call_hook(self._plugins, "mosaic_robot_state_changed", state=state)

    def _report(self, code: str, message: str) -> None:
        fields = {"robotId": self.robot_id, "code": code}
        if not code:
            logger.info("%s", message, extra=fields)
            return
        logger.error("%s (%s) %s", message, code, reason(code).cure, extra=fields)
        if code == "signal.replaced":
            self._error = SignalingError(message, code=code)

    def near_changed(self, urls: Sequence[str]) -> None:
        """Where the robot serves operators on its own network now; those who came another way hear of it."""
        self._near.changed(urls)

    # -- what peers tell -----------------------------------------------------------------------------------------

    def _link_of(self, peer_id: str) -> ServerLink:
        """To the server that introduced the peer."""
        return next(link for link in self._links if link.introduced(peer_id))

    def signal(self, message: SignalingMessage) -> None:
        peer_id = getattr(message, "rtc_connection_id", "")
        self._link_of(peer_id).signal(message)

    def newest_ice_servers(self) -> Sequence[IceServer]:
        return self._newest_ice_servers

    def peer_connected(self, peer: RobotPeer) -> None:
        logger.info("operator %s connected", peer.sender.name or peer.peer_id, extra={"peerId": peer.peer_id})
        for other in tuple(self._peers.values()):
            if other is not peer and other.sender.session_id == peer.sender.session_id:
                other.close("peer.replaced")
        self._link_of(peer.peer_id).peer_connected(peer.peer_id)
        if self._control is not None:
            self._control.peer_connected(peer)
        call_hook(self._plugins, "mosaic_peer_connected", sender=peer.sender)

    def peer_closed(self, peer: RobotPeer, code: str, message: str) -> None:
        is_known = self._peers.get(peer.peer_id) is peer
        if is_known:
            del self._peers[peer.peer_id]
        closing = asyncio.ensure_future(peer.closed())
        self._closing.add(peer)
        closing.add_done_callback(lambda _: self._closing.discard(peer))
        fields = {"peerId": peer.peer_id, "code": code}
        logger.info("operator %s left (%s)", peer.sender.name or peer.peer_id, code, extra=fields)
        if is_known:
            self._link_of(peer.peer_id).peer_ended(peer.peer_id, code, message)
        if peer.connected_at_s is not None:
            if self._control is not None:
                self._control.peer_closed(peer, code, message)
            call_hook(self._plugins, "mosaic_peer_closed", sender=peer.sender, code=code)

    def lease_changed(self, resource: str, holder: Sender | None, epoch: int, cause: str) -> None:
        arguments = {"resource": resource, "holder": holder, "epoch": epoch, "cause": cause}
        call_hook(self._plugins, "mosaic_lease_changed", **arguments)

    def stop_changed(self, is_stopped: bool, by: str, reason: str) -> None:
        call_hook(self._plugins, "mosaic_stop_changed", is_stopped=is_stopped, by=by, reason=reason)

    def command_refused(self, label: str, sender: Sender, code: str) -> None:
        if self._control is not None:
            self._control.journal.refused(label, sender, code)
        call_hook(self._plugins, "mosaic_command_received", label=label, sender=sender, accepted=False, code=code)

    # -- what handlers tell --------------------------------------------------------------------------------------

    def command_done(self, outcome: Outcome) -> None:
        item = outcome.item
        if outcome.code:
            peer = self._peers.get(item.sender.peer_id)
            if peer is not None:
                peer.operator.refuse(item.channel, item.seq, outcome.code, outcome.message)
        if self._control is not None:
            self._control.command_done(outcome)
        arguments = {"label": item.channel, "sender": item.sender, "accepted": not outcome.code, "code": outcome.code}
        call_hook(self._plugins, "mosaic_command_received", **arguments)

    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        call_hook(self._plugins, "mosaic_connector_failed", label=label, error=error, restart_in_s=restart_in_s)

    def talking_changed(self, label: str, who: Sender | None) -> None:
        for peer in tuple(self._peers.values()):
            peer.media.talking_changed(label, who)

    # -- the live table ------------------------------------------------------------------------------------------

    def snapshot(self) -> RobotSnapshot:
        """The robot now. Event loop."""
        now_s, control = time.monotonic(), self._control
        factors = control.limit_factors if control is not None else {}
        return RobotSnapshot(
            robot_id=self.robot_id,
            state=self._state,
            uptime_s=now_s - self._started_at_s,
            connectors=self._runs.snapshot(factors) if self._runs is not None else (),
            peers=tuple(self._peer_row(peer, now_s) for peer in self._peers.values()),
            leases=control.leases() if control is not None else (),
            stop=control.stop_snapshot() if control is not None else None,
            servers=tuple(
                ServerSnapshot(link.server.name, link.server.config.ws_url, link.state) for link in self._links
            ),
        )

    def _peer_row(self, peer: Peer, now_s: float) -> PeerSnapshot:
        sender = peer.sender
        return PeerSnapshot(
            peer_id=sender.peer_id,
            session_id=sender.session_id,
            operator_id=sender.operator_id,
            name=sender.name,
            role=sender.role,
            phase=peer.phase,
            connected_s=None if peer.connected_at_s is None else now_s - peer.connected_at_s,
            channels=peer.channels,
            watches=self._site.media.watched_by(sender.peer_id) if self._site is not None else (),
            is_person=sender.is_person,
            is_original=sender.is_original,
        )


def _servers(config: RobotConfig, connect_socket: SocketConnector, lan: KnownServer | None) -> tuple[KnownServer, ...]:
    own = () if config.server is None else (KnownServer(FLEET, config.server, connect_socket),)
    servers = own if lan is None else (*own, lan)
    if not servers:
        raise ValueError("a robot needs a server: its configuration names none")
    return servers
