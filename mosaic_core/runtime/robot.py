"""The robot: its handlers run, its peers come and go, its servers are there or not; each goes on without the others."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator, Sequence

import pluggy

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.hook_calls import call_hook
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.live_robot import LiveRobot, RobotPlan
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.observation.counters import RobotSnapshot
from mosaic_core.runtime.observation.loop_blocks import LoopBlocks
from mosaic_core.runtime.peers.near_path import NearPath
from mosaic_core.runtime.signaling.server_link import FLEET, KnownServer
from mosaic_core.runtime.threads.handover import on_loop
from mosaic_core.runtime.threads.loop_guard import LoopBlock
from mosaic_core.runtime.threads.slow_code import told_when_slow
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory
from mosaic_core.runtime.transport.transport import AnswererFactory, NetworkWatcher, SocketConnector
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import RobotConfig

logger = logging.getLogger(__name__)


class Robot:
    """Runs on an event loop until it is stopped, once, and tells plugins and journal what happens on it."""

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
        self._plan = RobotPlan(
            config=config,
            connectors=tuple(connectors),
            catalogue=Catalogue.of(entry for connector in connectors for entry in connector.entries),
            servers=_known_servers(config, connect_socket, lan),
            make_answerer=make_answerer,
            open_stream=open_stream,
            open_sound=open_sound,
            software=software,
        )
        self._shared = shared
        self._plugins = plugins
        self._watch_network = watch_network
        self._state = "offline"
        self._started_at_s = time.monotonic()
        self._near = NearPath()
        self._live: LiveRobot | None = None
        self._loop_blocks = LoopBlocks()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop_wanted = False
        self._stopping = asyncio.Event()

    @property
    def robot_id(self) -> str:
        return self._plan.servers[0].robot_id

    @property
    def state(self) -> str:
        """``connecting``, ``ready``, ``offline`` or ``stopped``: the relation to the server, of several the best."""
        return self._state

    @property
    def catalogue(self) -> Catalogue:
        return self._plan.catalogue if self._live is None else self._live.site.catalogue

    @property
    def peers(self) -> tuple[Sender, ...]:
        """The operators whose peer connection is up."""
        return self._live.peers.connected() if self._live is not None else ()

    @property
    def _running(self) -> LiveRobot:
        assert self._live is not None
        return self._live

    # -- life ----------------------------------------------------------------------------------------------------

    async def run(self) -> None:
        """Run until :meth:`stop`. Raises :class:`SignalingError` (``signal.replaced``) if the same robot connected
        elsewhere and no other server is left, and whatever a shared thing of the plugins raises when it is entered."""
        self._loop = asyncio.get_running_loop()
        live = LiveRobot(self._plan, self._near, self)  # first: keepers that begin tell its handlers
        await asyncio.to_thread(self._shared.enter, told_when_slow)
        try:
            await self._run(live)
        finally:
            await asyncio.to_thread(self._shared.leave)
        error = self._running.servers.error
        if error is not None and not self._stop_wanted:
            raise error

    async def _run(self, live: LiveRobot) -> None:
        self._live = live
        live.runs.start()
        live.guard.start()
        signaling = asyncio.create_task(live.servers.run(), name="mosaic-signaling")
        signaling.add_done_callback(lambda _: self._stopping.set())
        watching = None
        if self._watch_network is not None:
            watching = asyncio.create_task(self._watch_network(live.network_changed), name="mosaic-network")
        try:
            if not self._stop_wanted:
                await self._stopping.wait()
        finally:
            if watching is not None:
                watching.cancel()
            await live.end(signaling)
        if not signaling.cancelled() and (bug := signaling.exception()) is not None:
            raise bug

    def stop(self) -> None:
        """Begin an orderly end. Any thread, any number of times, also before :meth:`run`."""
        self._stop_wanted = True
        if self._loop is not None and not on_loop(self._loop, self._stopping.set):
            logger.debug("stop() after the robot's event loop was closed")

    async def become(self, connectors: Sequence[Connector], shared: Shared) -> None:
        """Have other connectors from now on: those that are the same objects as before go on untouched, others end,
        made safe first, and begin. ``shared``: what the new ones share, with what stays of before. Event loop; while
        the robot runs."""

        async def change() -> None:
            before, self._shared = self._shared, shared
            await asyncio.to_thread(before.leave_to, shared)
            try:
                await asyncio.to_thread(shared.enter, told_when_slow)
            except Exception:
                logger.exception("what the connectors share could not be opened")

        await self._running.become(connectors, change)

    @contextlib.asynccontextmanager
    async def held(self, connectors: Sequence[Connector]) -> AsyncIterator[None]:
        """While ``connectors`` may be replaced: what they move is made safe, and no command acts. Event loop."""
        runs = self._running.runs
        try:
            await runs.hold(connectors)
            yield
        finally:
            runs.resume(connectors)

    def make_safe(self, cause: str, patience_s: float) -> bool:
        """Run every safe action and wait for them; ``False`` if one did not end in time. Any thread; blocks."""
        return self._live is None or self._live.runs.safety.make_all_safe(cause, patience_s)

    # -- what servers tell ---------------------------------------------------------------------------------------

    def server_changed(self) -> None:
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

    def command_refused(self, label: str, sender: Sender, refusal: GateRefusal) -> None:
        self._running.control.journal.refused(label, sender, refusal)
        self._tell_command(label, sender, refusal)

    # -- what handlers tell --------------------------------------------------------------------------------------

    def command_done(self, outcome: Outcome) -> None:
        item, refusal = outcome.item, outcome.refusal
        peer = self._running.peers.get(item.sender.peer_id) if refusal is not None else None
        if peer is not None and refusal is not None:
            peer.operator.refuse(item.channel, item.seq, refusal.code, refusal.message, refusal.gate)
        self._running.control.command_done(outcome)
        self._tell_command(item.channel, item.sender, refusal)

    def _tell_command(self, label: str, sender: Sender, refusal: GateRefusal | None) -> None:
        code, gate = ("", "") if refusal is None else (refusal.code, str(refusal.gate))
        arguments = {"label": label, "sender": sender, "accepted": refusal is None, "code": code, "gate": gate}
        call_hook(self._plugins, "mosaic_command_received", **arguments)

    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        call_hook(self._plugins, "mosaic_connector_failed", label=label, error=error, restart_in_s=restart_in_s)

    def loop_blocked(self, block: LoopBlock) -> None:
        self._loop_blocks.add(block)
        arguments = {"label": block.label, "place": block.place, "duration_s": block.duration_s}
        call_hook(self._plugins, "mosaic_loop_blocked", **arguments)

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
            loop=self._loop_blocks.snapshot(time.monotonic()),
        )


def _known_servers(
    config: RobotConfig, connect_socket: SocketConnector, lan: KnownServer | None
) -> tuple[KnownServer, ...]:
    own = () if config.server is None else (KnownServer(FLEET, config.server, connect_socket),)
    servers = own if lan is None else (*own, lan)
    if not servers:
        raise ValueError("a robot needs a server: its configuration names none")
    return servers
