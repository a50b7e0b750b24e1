"""A robot with chosen connectors and operators beside it, in memory: all of MOSAIC but the network.

Handlers run on their real threads and in real time here; for everything that can be tested without, ``build``,
``collect`` and ``feed`` are quicker and exact.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import pluggy

from mosaic_core.contract.configurer import Configurer, check_configurer, check_written
from mosaic_core.laboratory.memory_network import MemoryNetwork
from mosaic_core.laboratory.memory_server import BASE_URL, MemoryServer
from mosaic_core.laboratory.networks import Network
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.operator.mosaic_operator import MosaicOperator
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Configured
from mosaic_core.runtime.configuration.checked_config import CheckedConfig, CheckedConnector
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.lease_groups import lease_groups
from mosaic_core.runtime.configuration.resolver import ConnectorResolver, uninstalled
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.runtime.robot import Robot
from mosaic_core.words.config import AuthConfig, ConnectorConfig, ControlConfig, RobotConfig, ServerConfig
from mosaic_core.words.errors import ConfigError
from mosaic_core.words.signaling import RobotStatus

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
PATIENCE_S = 30.0


@dataclass(frozen=True, slots=True)
class ConnectorEntry:
    """One entry of ``connectors:``, with the class instead of an installed type."""

    configurer: type[Configurer[Any]]
    config: ConnectorConfig


def connector(
    configurer: type[Configurer[Any]],
    *,
    label: str = "under_test",
    params: Mapping[str, Any] | None = None,
    safety: Mapping[str, Any] | None = None,
    delivery: str | Mapping[str, Any] | None = None,
) -> ConnectorEntry:
    """One connector of :func:`joined`, written as in the YAML file. Raises :class:`ConfigError` for mistakes in
    ``label`` and ``delivery``; those in params and safety are told by :func:`joined`."""
    check_configurer(configurer, "connector")
    check_written("connector", params=params, safety=safety)
    entry = {"type": configurer.connector_type or "under-test", "label": label, "params": dict(params or {})}
    document = YamlDocument({**entry, "safety": dict(safety) if safety else None, "delivery": delivery})
    config, problems = validated(ConnectorConfig, document.tree, document, ())
    if config is None:
        raise ConfigError(problems)
    return ConnectorEntry(configurer, config)


@dataclass(slots=True)
class Joined:
    """The robot and operator that a test has joined."""

    robot: Robot
    """The robot that runs."""
    configured: Configured
    """Its connectors: ``configured.connectors[0].handlers[0]`` is the handler of the first."""
    operator: MosaicOperator
    """Alice, signed in."""
    connection: RobotConnection
    """The first operator's; a second one's comes from :meth:`another_operator`."""
    network: Network
    """What joins them, and can be broken."""
    _server: MemoryServer
    _stack: contextlib.AsyncExitStack

    async def another_operator(
        self, name: str = "Bob", *, role: str = "operator", is_person: bool = True
    ) -> RobotConnection:
        """A second operator connects, without any lease; signed off when the test ends. ``role``: ``observer``,
        ``operator`` or ``supervisor``."""
        self._server.roles[name] = role
        _, connection = await signed_in(self._stack, self._server, self.network, name, is_person=is_person)
        return connection

    def cut(self) -> None:
        """Pull the cable: nothing arrives any more and nobody is told. The robot notices within two seconds."""
        self.network.cut()


@asynccontextmanager
async def joined(
    *entries: ConnectorEntry,
    plugins: pluggy.PluginManager | None = None,
    takes_leases: bool = False,
    control: Mapping[str, Any] | None = None,
    network: Network | None = None,
) -> AsyncIterator[Joined]:
    """``async with joined(connector(BatteryConfigurer, label="battery")) as link:`` a robot and its operator Alice,
    connected. ``link.connection.receivable("battery")`` and the other stores work as with a real robot.

    Alice is a person and holds no lease; with ``takes_leases`` she holds that of everything that needs one, and
    ``await link.connection.control.take("motion")`` takes one later. ``control`` is written as in the YAML file.
    ``network`` is what the fixture ``impaired_network`` returns; without, one that is perfect. Pictures are taken by
    ``next_image()`` of the store as BGR arrays; ``next_frame()`` has them in memory as :class:`MemoryFrame`,
    unconverted, over real WebRTC as :class:`av.VideoFrame`. Raises :class:`ConfigError` for mistakes in params. Hook
    plugins that are installed are not loaded; give your own in ``plugins``.
    """
    _check_joins(entries, network)
    configured = configured_with(entries, control, plugins)
    between: Network = network or MemoryNetwork()
    server = MemoryServer(ROBOT_ID, between.robot_ice_servers)
    async with running_robot(configured, server, between, "laboratory") as robot, contextlib.AsyncExitStack() as stack:
        operator, connection = await signed_in(stack, server, between, "Alice")
        if takes_leases:
            await _take_leases(connection, configured)
        yield Joined(robot, configured, operator, connection, between, server, stack)


def _check_joins(entries: Sequence[object], network: object) -> None:
    """Raise :class:`TypeError` for what is joined without ``connector(…)``, and for a network by its name."""
    for one in entries:
        if not isinstance(one, ConnectorEntry):
            what = one.__name__ if isinstance(one, type) else f"an instance of {type(one).__name__}"
            raise TypeError(f"`joined` takes what `connector(ItsConfigurer, label=…)` returns, and not {what}")
    if isinstance(network, str | LinkProfile):
        raise TypeError(
            "`network` is what the fixture impaired_network returns: write `network=impaired_network("
            f"{network!r})`, with the fixture among the arguments of the test"
        )


@asynccontextmanager
async def running_robot(
    configured: Configured, server: MemoryServer, network: Network, software: str
) -> AsyncIterator[Robot]:
    """The robot of a configuration, while the block runs; what ended it otherwise is raised at the end."""
    robot = Robot(
        configured.config,
        configured.connectors,
        shared=configured.shared,
        plugins=configured.plugins,
        connect_socket=server.connect,
        make_answerer=network.answerer,
        open_stream=network.open_stream,
        open_sound=network.open_sound,
        software=f"mosaic-core/{software}",
    )
    running = [asyncio.create_task(robot.run()), asyncio.create_task(server.keep_alive())]
    try:
        yield robot
    finally:
        robot.stop()
        running[1].cancel()
        await asyncio.wait(running)
    running[0].result()


async def _take_leases(connection: RobotConnection, configured: Configured) -> None:
    for resource in lease_groups(configured.connectors):
        await connection.control.take(resource)


async def signed_in(
    stack: contextlib.AsyncExitStack, server: MemoryServer, network: Network, name: str, *, is_person: bool = True
) -> tuple[MosaicOperator, RobotConnection]:
    """An operator of this name, connected to the robot of ``server``; the end of ``stack`` signs it off."""
    operator = MosaicOperator(
        BASE_URL,
        name,
        open_socket=server.connect,
        make_offerer=network.offerer,
        http=server.http(),
        is_person=is_person,
    )
    await stack.enter_async_context(operator)
    await operator.wait_status(server.robot_id, RobotStatus.READY_TO_CONNECT, PATIENCE_S)
    return operator, await operator.connect(server.robot_id, timeout_s=PATIENCE_S)


def configured_with(
    entries: Sequence[ConnectorEntry],
    control: Mapping[str, Any] | None = None,
    plugins: pluggy.PluginManager | None = None,
) -> Configured:
    """What a robot with these connectors is built from, and nothing that is installed. Raises :class:`ConfigError`."""
    configurer = AutoConfigurer(resolver=ConnectorResolver([]), plugins=plugins or hook_plugins([]))
    return configurer.configure(checked_config(entries, control))


def checked_config(entries: Sequence[ConnectorEntry], control: Mapping[str, Any] | None = None) -> CheckedConfig:
    """What a YAML file with these connectors is; raises :class:`ConfigError`."""
    tree = {"connectors": [entry.config.model_dump(mode="python") for entry in entries]}
    document = YamlDocument(tree)
    auth = AuthConfig.model_validate({"type": "no-authorization", "robot_id": ROBOT_ID})
    config = RobotConfig(
        server=ServerConfig(ws_url="ws://memory.invalid", auth=auth),
        control=ControlConfig.model_validate(control or {}),
        connectors=tuple(entry.config for entry in entries),
    )
    checked, problems, labels = [], [], set[str]()
    for index, entry in enumerate(entries):
        place = ("connectors", index)
        raw = entry.config
        if raw.label in labels:
            message = f"two connectors have the label '{raw.label}'"
            problems.append(document.problem(place, message, cure="give each a label: connector(…, label=…)"))
        labels.add(raw.label)
        params, more = validated(entry.configurer.params_model, raw.params, document, (*place, "params"))
        safety, others = validated(entry.configurer.safety_model, raw.safety or {}, document, (*place, "safety"))
        problems += [*more, *others]
        if params is not None and safety is not None:
            installed = uninstalled(entry.configurer, raw.type)
            checked.append(CheckedConnector(raw, entry.configurer, params, safety, installed, place, document))
    if problems:
        raise ConfigError(problems)
    return CheckedConfig(config, tuple(checked))


async def until(condition: Callable[[], object], what: str = "", timeout_s: float = PATIENCE_S) -> float:
    """Wait until ``condition()`` is true; returns the seconds it took, raises :class:`TimeoutError` with ``what``."""
    if not callable(condition):
        raise TypeError(f"`until` asks a function again and again: write `until(lambda: …)`, and not {condition!r}")
    if not isinstance(what, str):
        raise TypeError(f"`what` names in words what `until` waits for: write `timeout_s={what!r}` for a bound")
    start_s = time.monotonic()
    while not condition():
        if time.monotonic() - start_s > timeout_s:
            raise TimeoutError(f"after {timeout_s} s still not true: {what or 'the condition'}")
        await asyncio.sleep(0.005)  # what it waits for may happen on any thread
    return time.monotonic() - start_s
