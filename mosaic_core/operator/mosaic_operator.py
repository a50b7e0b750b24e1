"""The headless operator: sign in, list robots, connect to some of them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Self

import httpx

from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.operator.delivery.data_port import now_us
from mosaic_core.operator.lan.paired_robots import PairedRobot
from mosaic_core.operator.lan.pairing import pair_at, paired_robot, place_to_pair
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.operator.reconnection import Reconnection
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.operator.signaling.rest_api import RestApi, RobotSummary, log_in
from mosaic_core.operator.signaling.signaling_socket import OperatorSignalingSocket
from mosaic_core.operator.stores.channel_plan import Known, UnknownLabel, media_labels_of
from mosaic_core.operator.stores.known_robots import KnownRobots
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.transport.operator_transport import OffererFactory
from mosaic_core.runtime.transport.transport import NetworkWatcher, SocketConnector
from mosaic_core.words import signaling
from mosaic_core.words.codes import RESULT_REASONS, reason
from mosaic_core.words.described import DescribedConnector
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.ice import IceServer, IceTransportPolicy
from mosaic_core.words.signaling import RobotStatus, SignalingMessage

LOGIN_ROUTE = "/api/v1/account/login/access-token"
CODE_ROUTE = "/api/v1/account/login/one-time"
BREAK_S = 20.0
"""An original robot needs a moment until it takes the next operator; after this long nobody waits for it."""
RECONNECT_TIMEOUT_S = 15.0
"""For one attempt of a connection that comes back by itself; the next one follows."""


class MosaicOperator:
    """Connects one signed-in account to robots; use it as ``async with await MosaicOperator.login(…) as operator``.

    All calls and callbacks on one event loop. ``is_person``: a person decides what is sent; programs give way to
    persons, so say so only where it is true. ``ice_transport_policy="relay"`` goes only through TURN.
    ``uses_bulk_lane=False`` puts bulk data beside everything else on the one peer connection. ``certificate`` is the
    only one that the server may present, as PEM; empty: any that an authority vouches for. ``open_socket``,
    ``make_offerer``, ``http``, ``clock_us`` (this operator's monotonic clock) and ``watch_network`` are for tests.
    """

    def __init__(
        self,
        base_url: str,
        access_token: str,
        *,
        is_person: bool = False,
        ice_transport_policy: IceTransportPolicy = "all",
        uses_bulk_lane: bool = True,
        certificate: str = "",
        open_socket: SocketConnector | None = None,
        make_offerer: OffererFactory | None = None,
        http: httpx.AsyncBaseTransport | None = None,
        clock_us: Callable[[], int] = now_us,
        watch_network: NetworkWatcher | None = None,
    ) -> None:
        self.access_token = access_token
        self.is_person = is_person
        self.ice_transport_policy: IceTransportPolicy = ice_transport_policy
        self.uses_bulk_lane = uses_bulk_lane
        self.paired_id: str | None = None
        """The robot that this operator is signed in to by pairing: the only one that it sees."""
        self.rest = RestApi(base_url, access_token, http, certificate)
        self.stores = StoreManager(self._known_of, self._store_opened, self._store_released)
        self._robots = KnownRobots(self.rest)
        self.statuses = self._robots.statuses
        """The last known status of every robot in :meth:`watch`."""
        self.timelines: dict[str, ConnectionTimeline] = {}
        """Of the newest attempt to reach each robot, also of one that failed."""
        self.catalogues = self._robots.catalogues
        """Short catalogues, as the server tells them."""
        self._make_offerer = make_offerer
        self._clock_us = clock_us
        self._connections: dict[str, RobotConnection] = {}
        self._session_ids: dict[str, str] = {}
        self._reconnections: list[Reconnection] = []
        self._tasks = BackgroundTasks()
        self._watch_network = watch_network or (_default_watch() if open_socket is None else None)
        self._watches_network = False
        self._watched: set[str] = set()
        url = base_url.rstrip("/").replace("http", "ws", 1) + "/ws/user"
        self._signaling = OperatorSignalingSocket(
            url, access_token, open_socket or _default_socket(certificate), self._signaled
        )

    @classmethod
    async def login(cls, base_url: str, email: str, password: str, *, is_person: bool = False) -> Self:
        """Sign in with a password; raises :class:`AuthError` or :class:`SignalingError`."""
        token = await log_in(base_url, LOGIN_ROUTE, {"username": email, "password": password})
        return cls(base_url, token, is_person=is_person)

    @classmethod
    async def login_with_code(cls, base_url: str, code: str, *, is_person: bool = False) -> Self:
        """Sign in with a one-time code, which ``POST /api/v1/account/one-time-code`` gives to who is signed in."""
        return cls(base_url, await log_in(base_url, CODE_ROUTE, {"code": code}), is_person=is_person)

    @classmethod
    async def pair(cls, robot: str, *, pin: str, name: str = "", is_person: bool = False) -> Self:
        """Pair this machine with a robot on its network and sign in: by its address, announced name or id, and by the
        PIN or code that the robot shows.

        The sign-in is kept for :meth:`find`. ``name``: what the robot calls this machine; by default the host's name.
        Raises :class:`AuthError` (``auth.pairing``, ``auth.pairing_locked``) and :class:`SignalingError`
        (``lan.not_found``, ``lan.several``, ``lan.other_robot``, ``lan.search``, ``signal.unreachable``) within a
        minute.
        """
        paired, _ = await pair_at(await place_to_pair(robot), pin, name)
        return cls._at(paired, is_person=is_person)

    @classmethod
    async def find(cls, robot: str, *, is_person: bool = False) -> Self:
        """Sign in to a robot that this machine is paired with, by its name, id or address, wherever on this network it
        is.

        It has proved to be that robot before it is shown the sign-in. Raises :class:`SignalingError`
        (``lan.not_paired``, ``lan.several``, ``lan.not_found``, ``lan.other_robot``, ``lan.search``), and
        :class:`AuthError` (``lan.not_paired``) where the robot has let go of this machine, within half a minute.
        """
        return cls._at(await paired_robot(robot), is_person=is_person)

    @classmethod
    def _at(cls, paired: PairedRobot, *, is_person: bool) -> Self:
        made = cls(paired.url, paired.access_token, is_person=is_person, certificate=paired.certificate)
        made.paired_id = paired.robot_id
        return made

    async def __aenter__(self) -> Self:
        self._start()
        return self

    def _start(self) -> None:
        self._signaling.start()
        if self._watch_network is not None and not self._watches_network:
            self._watches_network = True
            self._tasks.start(self._watch_network(self._network_changed))

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """End all connections and sign off."""
        self._tasks.cancel()
        await asyncio.gather(*(connection.close() for connection in list(self._connections.values())))
        self.stores.close()
        await self._signaling.close()
        await self.rest.close()

    async def robots(self) -> list[RobotSummary]:
        """All robots that this account may see."""
        return await self.rest.robots()

    def watch(self, robot_ids: Sequence[str]) -> None:
        """Hear of the status and catalogue of these robots too, also after a reconnection. Raises :class:`TypeError`
        for what is no id."""
        for one in robot_ids:
            if not isinstance(one, str):
                raise TypeError(f"a robot is named by its id, such as robot.id, not by {one!r}")
        self._watched.update(robot_ids)
        self._start()
        self._signaling.subscribe(sorted(self._watched))

    async def wait_status(self, robot_id: str, status: RobotStatus, timeout_s: float = 10.0) -> None:
        """Until the robot has this status; raises :class:`TimeoutError`."""
        self.watch([robot_id])
        await self._robots.wait_status(robot_id, status, timeout_s)

    def connection(self, robot_id: str) -> RobotConnection | None:
        """The live connection to a robot."""
        return self._connections.get(robot_id)

    async def connect(
        self,
        robot_id: str,
        *,
        connectors: Sequence[RobotConnector] = (),
        described: Sequence[DescribedConnector] = (),
        may_break: bool = False,
        timeout_s: float = 30.0,
        reconnect: bool = False,
    ) -> RobotConnection:
        """Connect to a robot; a live connection to it is closed first.

        ``connectors`` are opened from the start. ``reconnect``: once made, it comes back by itself when it is lost,
        until it is closed; its state is ``reconnecting`` meanwhile, and stores wait. Raises :class:`ConnectionFailed`,
        :class:`SignalingError` or :class:`AuthError`, each with a code.

        Original robots announce no catalogue. Their connectors are those that the server has a description of, and
        those ``described`` here, which count first; others need a data type. Such a robot sends every camera that is
        known when the connection is made, unless ``connectors`` are named and no camera is among them; one that is
        asked for later needs another connection: ``may_break`` allows that. Nothing else flows for about half a second
        then, and drives that are known are sent zeros before.
        """
        self.watch([robot_id])
        previous = self._connections.pop(robot_id, None)
        if previous is not None:
            await previous.close()
        loop = asyncio.get_running_loop()
        ends_at_s = loop.time() + timeout_s
        self.timelines[robot_id] = ConnectionTimeline(time.monotonic())
        await self._signaling.wait_ready(timeout_s)
        plan = await self._plan(robot_id, connectors, described)
        connection = RobotConnection(
            plan, self.stores, self._make_offerer or self._aiortc_offerer(), self._signaling.send
        )
        self._connections[robot_id] = connection
        try:
            await connection.open(max(0.1, ends_at_s - loop.time()))
            self._open_named(connectors, is_connected=True)
        except BaseException:
            self._connections.pop(robot_id, None)
            await connection.close()
            raise
        if reconnect:
            connection.keep()
        if may_break:
            connection.allow_break()
        if reconnect or may_break:
            reopen = partial(self._reopen, connection, connectors, described)
            self._tasks.start(self._keep(Reconnection(connection, reopen, None if reconnect else BREAK_S)))
        return connection

    async def _keep(self, reconnection: Reconnection) -> None:
        self._reconnections.append(reconnection)
        try:
            await reconnection.run()
        finally:
            self._reconnections.remove(reconnection)

    async def _reopen(
        self,
        connection: RobotConnection,
        connectors: Sequence[RobotConnector],
        described: Sequence[DescribedConnector],
    ) -> None:
        self.timelines[connection.robot_id] = ConnectionTimeline(time.monotonic())
        await self._signaling.assured(RECONNECT_TIMEOUT_S)
        plan = await self._plan(connection.robot_id, connectors, described)
        await connection.reopen(plan, RECONNECT_TIMEOUT_S)

    async def _plan(
        self, robot_id: str, connectors: Sequence[RobotConnector], described: Sequence[DescribedConnector]
    ) -> ConnectionPlan:
        agreed, timeline = self._signaling.session.agreed, self.timelines[robot_id]
        await self._robots.look_up(robot_id, described, has_catalogues="catalogue" in agreed)
        await self._open_first(robot_id, connectors)
        session_id = self._session_ids.get(robot_id) if "multiPeer" in agreed else None
        timeline.mark("asked", time.monotonic())
        made, ice_servers = await asyncio.gather(self.rest.create_connection(robot_id, session_id), self._ice_servers())
        timeline.mark("granted", time.monotonic())
        if made.session_id is not None:
            self._session_ids[robot_id] = made.session_id
        known = self._robots.known(robot_id)
        return ConnectionPlan(
            robot_id=robot_id,
            peer_id=made.rtc_session_id,
            session_id=made.session_id,
            catalogue=None if known.is_told else known.catalogue,
            described=known.catalogue if known.is_told else None,
            media_labels=media_labels_of(known, self.stores.stores_of(robot_id), connectors),
            ice_servers=ice_servers,
            agreed=agreed,
            is_person=self.is_person,
            clock_us=self._clock_us,
            timeline=timeline,
            fresh_ice_servers=self._ice_servers,
            uses_bulk_lane=self.uses_bulk_lane,
        )

    async def _open_first(self, robot_id: str, connectors: Sequence[RobotConnector]) -> None:
        """Make the stores of ``connectors``. That a robot is offline is told before a label that it doesn't have."""
        try:
            self._open_named(connectors)
        except UnknownLabel as error:
            if any(one.id == robot_id and not one.is_online for one in await self.rest.robots()):
                code = "signal.robot_offline"
                raise SignalingError(reason(code).sentence, code=code) from error
            raise

    def _open_named(self, connectors: Sequence[RobotConnector], *, is_connected: bool = False) -> None:
        """Make the stores of ``connectors``; of which nothing is known yet, the robot may tell once connected."""
        for connector in connectors:
            robot_id = connector.robot_id
            has_store = any(one.robot_connector.key == connector.key for one in self.stores.stores_of(robot_id))
            is_known = self._known_of(robot_id).for_connector(connector) is not None
            if not has_store and (is_known or is_connected):
                self.stores.get_or_create_store(connector)

    async def _ice_servers(self) -> tuple[IceServer, ...]:
        """Fresh ones: credentials of our server live for minutes."""
        return tuple(await self.rest.ice_servers())

    def _signaled(self, message: SignalingMessage) -> None:
        match message:
            case signaling.StatusUpdate(robot_id=str(robot_id), status=status):
                if self._robots.status_changed(robot_id, status):
                    self._robot_returned(robot_id)
            case signaling.CatalogueUpdate(robot_id=robot_id, catalogue=catalogue):
                self.catalogues[robot_id] = catalogue
            case signaling.ErrorEcho(request_type=request, code=code) if request.startswith("signaling."):
                self._refused(code)
            case signaling.SdpAnswer() | signaling.ExchangeIceCandidate() | signaling.ClosePeerConnection():
                for connection in list(self._connections.values()):
                    if connection.peer_id == message.rtc_connection_id:
                        connection.signaled(message)
            case _:
                pass

    def _robot_returned(self, robot_id: str) -> None:
        for reconnection in self._reconnections:
            if reconnection.connection.robot_id == robot_id:
                reconnection.connection.robot_returned()
                reconnection.wake()

    def _network_changed(self, change: NetworkChange) -> None:
        """Whoever waits tries again now; what was connected may hang, and is asked."""
        if change == "moved" or self._signaling.session.state != "ready":
            self._signaling.renew()
        if change == "moved":
            self.rest.renew()
            for connection in self._connections.values():
                connection.doubt()
        for reconnection in self._reconnections:
            reconnection.wake()

    def _refused(self, code: int) -> None:
        """The server took an offer or candidate for none of ours; it does not say which, so: those being made."""
        why = RESULT_REASONS.get(code, "signal.unknown_connection")
        for connection in list(self._connections.values()):
            if connection.state in ("connecting", "reconnecting"):
                close = signaling.ClosePeerConnection(
                    rtc_connection_id=connection.peer_id, code=why, message=reason(why).sentence
                )
                connection.signaled(close)

    def _aiortc_offerer(self) -> OffererFactory:
        from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer

        return partial(AiortcOfferer, relay_only=self.ice_transport_policy == "relay")

    def _known_of(self, robot_id: str) -> Known:
        connection = self._connections.get(robot_id)
        if connection is not None and connection.state == "connected":
            return connection.known
        return self._robots.known(robot_id)

    def _store_opened(self, store: MosaicStore) -> None:
        connection = self._connections.get(store.robot_connector.robot_id)
        if connection is not None and connection.state == "connected":
            connection.store_opened(store)

    def _store_released(self, store: MosaicStore) -> None:
        connection = self._connections.get(store.robot_connector.robot_id)
        if connection is not None:
            connection.store_released(store)


def _default_watch() -> NetworkWatcher:
    from mosaic_core.adapters.machine.network_watch import watch_network

    return watch_network


def _default_socket(certificate: str) -> SocketConnector:
    from mosaic_core.adapters.signaling.websocket import open_websocket

    return partial(open_websocket, certificate=certificate or None)
