"""The robot of a configuration with a server and a network in memory, and operators who do what a drill tells them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from typing import Any
from uuid import UUID

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import DataChannelReceivable, MediaTrackHandler, reports_position
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.drill.commands import DrillCommand, NoCommand, moving_command
from mosaic_core.drill.position_reports import PositionReports
from mosaic_core.drill.recorder import ActRecorder, watched
from mosaic_core.laboratory.joining import PATIENCE_S, running_robot, signed_in
from mosaic_core.laboratory.memory_network import MemoryLink, MemoryNetwork
from mosaic_core.laboratory.memory_server import BASE_URL, MemoryServer
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.robot import Robot
from mosaic_core.words.config import AuthConfig, RobotConfig, ServerConfig
from mosaic_core.words.control import Refusal
from mosaic_core.words.data_type import Delivery

_NO_SERVER = ServerConfig(
    ws_url=BASE_URL.replace("http", "ws", 1), auth=AuthConfig(type="no-authorization", robot_id=UUID(int=1))
)
"""In place of the one that a configuration for the LAN alone does not name."""


@dataclass(frozen=True, slots=True)
class DrilledReceiver:
    """A receiver under drill. ``command`` is ``None`` where none could be made, and ``no_command`` says why."""

    label: str
    handler: DataChannelReceivable[Any]
    safety: ReceiverSafety
    delivery: Delivery
    recorder: ActRecorder
    reports: PositionReports
    command: DrillCommand | None
    no_command: str = ""


class _Camera(MediaTrackHandler):
    """Stands in for a camera in a dry drill: it has a label and shows nothing."""


class DrillOperator:
    """Plays one operator: a connection, its link, and the right to say anything on it."""

    def __init__(self, operator: MosaicOperator, connection: RobotConnection, link: MemoryLink) -> None:
        self.operator = operator
        self.connection = connection
        self.link = link
        self.refusals: list[str] = []
        self.gates: dict[str, str] = {}
        """Which gate refused with a code."""
        connection.on_refusal(self._refused)

    def _refused(self, refusal: Refusal) -> None:
        self.refusals.append(refusal.code)
        self.gates[refusal.code] = refusal.gate or ""

    @property
    def control(self) -> Any:
        return self.connection.control

    def cut(self) -> None:
        """From now on nothing of it arrives, and nobody is told."""
        self.link.is_cut = True

    def lose(self, label: str) -> None:
        """From now on nothing passes on this one channel, either way."""
        self.link.lost_labels.add(label)

    async def until_refused(self, code: str) -> bool:
        """Whether the robot says so within a second."""
        return await comes_true(lambda: code in self.refusals, 1.0)


@dataclass(slots=True)
class Rig:
    """A running robot. ``subjects``: its receivers, ``cameras``: the labels of its cameras, ``is_live``: it really
    acts."""

    subjects: tuple[DrilledReceiver, ...]
    cameras: tuple[str, ...]
    lease_expiry_s: float
    is_live: bool
    _robot: Robot
    _server: MemoryServer
    _network: MemoryNetwork
    _stack: AsyncExitStack
    _count: int = 0

    async def operator(self, role: str = "operator") -> DrillOperator:
        """Somebody new connects; a person. :meth:`dismiss` ends it."""
        self._count += 1
        name = f"{role} {self._count}"
        self._server.roles[name] = role
        operator, connection = await signed_in(self._stack, self._server, self._network, name)
        await connection.control.wait_for(lambda: connection.control.stop_state is not None, PATIENCE_S)
        return DrillOperator(operator, connection, [*self._network.links.values()][-1])

    def make_safe(self, patience_s: float) -> bool:
        """Run every safe action and wait for them; ``False`` if one did not end in time. Any thread; blocks."""
        return self._robot.make_safe("safety.shutdown", patience_s)

    async def dismiss(self, *operators: DrillOperator) -> None:
        """They are gone, and nothing of theirs is in anybody's way."""
        for one in operators:
            one.link.is_cut = False  # a good-bye that the robot hears, so that no lease lingers
            await one.operator.close()


@asynccontextmanager
async def rig_of(configured: Configured, *, live: bool) -> AsyncIterator[Rig]:
    """Run the robot of a configuration. Dry: no shared thing is entered, no sender or camera runs, no receiver acts."""
    subjects, connectors, cameras = _staged(configured.connectors, live=live)
    home = configured.config.server or _NO_SERVER
    staged = replace(configured, config=_staged_config(configured.config, home), connectors=connectors)
    if not live:
        staged = replace(staged, shared=Shared(), plugins=hook_plugins([]))
    server, network = MemoryServer(str(home.auth.robot_id)), MemoryNetwork()
    expiry_s = staged.config.control.lease_expiry_s
    async with running_robot(staged, server, network, "drill") as robot, AsyncExitStack() as stack:
        yield Rig(subjects, cameras, expiry_s, live, robot, server, network, stack)


def _staged_config(config: RobotConfig, server: ServerConfig) -> RobotConfig:
    """What is only a drill must not stand in the robot's own journal."""
    control = config.control.model_copy(update={"journal_file": None})
    return config.model_copy(update={"control": control, "server": server})


def _staged(
    connectors: Sequence[Connector], *, live: bool
) -> tuple[tuple[DrilledReceiver, ...], tuple[Connector, ...], tuple[str, ...]]:
    subjects: list[DrilledReceiver] = []
    kept: list[Connector] = []
    cameras: list[str] = []
    for connector in connectors:
        handlers = list(connector.handlers)
        receivers = [one for one in handlers if isinstance(one, DataChannelReceivable) and not is_request(one)]
        media = [one.label for one in handlers if isinstance(one, MediaTrackHandler)]
        cameras += media
        subjects += [_subject(connector, receiver, live=live) for receiver in receivers]
        if live:
            kept.append(connector)
        elif receivers or media:
            stand_ins = tuple(_Camera(label) for label in media)
            kept.append(replace(connector, handlers=(*receivers, *stand_ins)))
    return tuple(subjects), tuple(kept), tuple(cameras)


def is_request(receiver: DataChannelReceivable[Any]) -> bool:
    """Whether it answers questions: a stop and the loss of the lease cancel them, and silence means nothing to it."""
    return isinstance(receiver, RequestHandler)


def _subject(connector: Connector, receiver: DataChannelReceivable[Any], *, live: bool) -> DrilledReceiver:
    safety = ReceiverSafety.of(connector.safety, receiver)
    command, no_command = None, ""
    try:
        command = moving_command(receiver, safety)
    except NoCommand as reason:
        no_command = str(reason)
    if live and command is not None and command.positions and not reports_position(receiver):
        command, no_command = None, "it does not report its position, so a live drill would move it without knowing"
    recorder = watched(receiver, command, live=live)
    mode = connector.terms_of(receiver).mode
    reports = PositionReports(receiver, safety)
    return DrilledReceiver(receiver.label, receiver, safety, mode, recorder, reports, command, no_command)


async def comes_true(condition: Callable[[], object], timeout_s: float) -> bool:
    """Whether ``condition()`` became true in time; it may do so on any thread, so it is looked at every 2 ms."""
    ends_at_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() >= ends_at_s:
            return False
        await asyncio.sleep(0.002)
    return True
