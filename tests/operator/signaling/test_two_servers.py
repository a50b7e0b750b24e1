"""A robot that knows two servers: one lease, one set of peers; either server may be away; no id of one is another's."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass

import pytest

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.laboratory.joining import until
from mosaic_core.laboratory.memory_network import MemoryNetwork, memory_picture
from mosaic_core.laboratory.memory_server import BASE_URL, MemoryServer, MemorySocket
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.media.plain_stream import plain_streams
from mosaic_core.runtime.robot import Robot
from mosaic_core.runtime.signaling.server_link import LAN, KnownServer
from mosaic_core.words.codes import CloseCode
from mosaic_core.words.config import AuthConfig, RobotConfig, ServerConfig
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.signaling import RobotStatus

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
PATIENCE_S = 10.0
URLS = ("http://10.0.0.7:9002",)


class Server(MemoryServer):
    """One that can be away."""

    def __init__(self) -> None:
        super().__init__(ROBOT_ID)
        self.is_away = False
        self.robots: list[MemorySocket] = []

    async def connect(self, url: str) -> MemorySocket:
        if self.is_away:
            raise SignalingError("connection refused", code="signal.unreachable")
        socket = await super().connect(url)
        if socket.is_robot:
            self.robots.append(socket)
        return socket

    async def drop_robot(self, code: int = 1006) -> None:
        await self.robots[-1].close(code)


@dataclass
class Site:
    robot: Robot
    fleet: Server
    lan: Server
    network: MemoryNetwork
    running: asyncio.Task[None]
    stack: AsyncExitStack

    async def operator(self, server: Server, name: str) -> RobotConnection:
        operator = MosaicOperator(
            BASE_URL, name, open_socket=server.connect, make_offerer=self.network.offerer, http=server.http(),
            is_person=True,
        )  # fmt: skip
        await self.stack.enter_async_context(operator)
        await operator.wait_status(ROBOT_ID, RobotStatus.READY_TO_CONNECT, PATIENCE_S)
        return await operator.connect(ROBOT_ID, timeout_s=PATIENCE_S)


def known(server: MemoryServer, url: str) -> ServerConfig:
    return ServerConfig(ws_url=url, auth=AuthConfig.model_validate({"type": "no-authorization", "robot_id": ROBOT_ID}))


@asynccontextmanager
async def site(*, with_fleet: bool = True, fleet_is_away: bool = False) -> AsyncIterator[Site]:
    fleet, lan, network = Server(), Server(), MemoryNetwork()
    fleet.is_away = fleet_is_away
    config = RobotConfig.model_construct(server=known(fleet, "ws://fleet.invalid") if with_fleet else None)
    robot = Robot(
        config,
        (),
        shared=Shared(),
        plugins=hook_plugins([]),
        connect_socket=fleet.connect,
        make_answerer=network.answerer,
        open_stream=plain_streams(memory_picture),
        software="mosaic-core/testing",
        lan=KnownServer(LAN, known(lan, "ws://lan.invalid"), lan.connect),
    )
    running = asyncio.create_task(robot.run())
    beats = [asyncio.create_task(one.keep_alive()) for one in (fleet, lan)]
    try:
        async with AsyncExitStack() as stack:
            yield Site(robot, fleet, lan, network, running, stack)
    finally:
        robot.stop()
        for beat in beats:
            beat.cancel()
        await asyncio.wait([running, *beats])


def holder(connection: RobotConnection) -> str | None:
    view = connection.control.leases.get("motion")
    return view.holder.name if view is not None and view.holder is not None else None


async def test_a_lease_that_is_taken_through_one_server_is_seen_through_the_other() -> None:
    async with site() as here:
        ann = await here.operator(here.fleet, "Ann")
        bob = await here.operator(here.lan, "Bob")
        await ann.control.take("motion")
        await until(lambda: holder(bob) == "Ann")
        await until(lambda: {one.name for one in bob.control.peers} == {"Ann", "Bob"})
        states = {one.name: one.state for one in here.robot.snapshot().servers}
        assert states == {"fleet": "ready", "lan": "ready"}


async def test_the_same_ids_at_both_servers_are_two_operators() -> None:
    async with site() as here:
        ann = await here.operator(here.fleet, "Ann")
        other = await here.operator(here.lan, "Ann")
        await ann.control.take("motion")
        await until(lambda: holder(other) == "Ann")
        assert other.control.epoch_of("motion") == 0, "it holds no lease"
        ids = {(peer.operator_id, peer.peer_id.partition(":")[0]) for peer in here.robot.peers}
        assert ids == {("fleet:Ann", "fleet"), ("lan:Ann", "lan")}


async def test_a_ticket_of_one_server_opens_nothing_at_the_other() -> None:
    async with site() as here:
        await until(lambda: [one.state for one in here.robot.snapshot().servers] == ["ready", "ready"])
        here.lan._key = here.fleet._key  # what the fleet's server signs, brought to the robot by its own
        with pytest.raises(Exception, match="ticket"):
            await here.operator(here.lan, "Eve")
        assert await here.operator(here.fleet, "Ann")


@pytest.mark.parametrize("away", ["fleet", "lan"])
async def test_when_one_server_goes_the_operators_of_the_other_do_not_notice(away: str) -> None:
    async with site() as here:
        ann, bob = await here.operator(here.fleet, "Ann"), await here.operator(here.lan, "Bob")
        gone = here.fleet if away == "fleet" else here.lan
        gone.is_away = True
        await gone.drop_robot()
        states = {"fleet": "ready", "lan": "ready", away: "offline"}
        await until(lambda: {one.name: one.state for one in here.robot.snapshot().servers} == states)
        assert here.robot.state == "ready"
        assert ann.state == bob.state == "connected"
        cleo = await here.operator(here.lan if away == "fleet" else here.fleet, "Cleo")
        await cleo.control.take("motion")
        await until(lambda: holder(ann) == holder(bob) == "Cleo")


async def test_a_fleet_server_that_never_answers_leaves_the_lan_alone() -> None:
    async with site(fleet_is_away=True) as here:
        bob = await here.operator(here.lan, "Bob")
        await bob.control.take("motion")
        assert here.robot.state == "ready"


async def test_a_robot_for_its_own_network_alone_has_the_id_that_its_server_knows() -> None:
    async with site(with_fleet=False) as here:
        assert here.robot.robot_id == ROBOT_ID
        await here.operator(here.lan, "Bob")
        assert [peer.operator_id for peer in here.robot.peers] == ["Bob"], "alone it needs no scope"


async def test_replaced_at_one_server_it_goes_on_at_the_other_and_replaced_at_both_it_ends() -> None:
    async with site() as here:
        bob = await here.operator(here.lan, "Bob")
        await here.fleet.drop_robot(CloseCode.REPLACED)
        await until(lambda: here.robot.snapshot().servers[0].state == "stopped")
        assert bob.state == "connected"
        await here.lan.drop_robot(CloseCode.REPLACED)
        await asyncio.wait({here.running}, timeout=5)
        with pytest.raises(SignalingError) as caught:
            here.running.result()
        assert caught.value.code == "signal.replaced"


async def test_operators_of_the_fleet_are_told_the_near_path_and_those_who_are_near_are_not() -> None:
    async with site() as here:
        ann, bob = await here.operator(here.fleet, "Ann"), await here.operator(here.lan, "Bob")
        here.robot.near_changed(URLS)
        await until(lambda: ann.near_urls == URLS)
        cleo = await here.operator(here.fleet, "Cleo")
        await until(lambda: cleo.near_urls == URLS)
        assert bob.near_urls == ()


async def test_without_any_server_there_is_no_robot() -> None:
    network = MemoryNetwork()
    with pytest.raises(ValueError, match="needs a server"):
        Robot(
            RobotConfig.model_construct(server=None),
            (),
            shared=Shared(),
            plugins=hook_plugins([]),
            connect_socket=Server().connect,
            make_answerer=network.answerer,
            open_stream=plain_streams(memory_picture),
            software="mosaic-core/testing",
        )
