"""Which checks there are, in the order of their findings, and what each is given."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint, entry_points

from mosaic_core.contract.checks import CHECKS_GROUP, Check, CheckContext
from mosaic_core.doctor.board_checks import board_checks
from mosaic_core.doctor.code_checks import code_checks
from mosaic_core.doctor.config_checks import ConfigRead, config_checks, device_checks
from mosaic_core.doctor.encoder_checks import encoder_checks
from mosaic_core.doctor.examination import CheckRun
from mosaic_core.doctor.ice_checks import address_checks, ice_checks, relays_of
from mosaic_core.doctor.install_checks import install_checks
from mosaic_core.doctor.issued_ice_servers import NO_SERVER, Issued, IssuedIceServers
from mosaic_core.doctor.machine_checks import loop_lag_check, machine_checks
from mosaic_core.doctor.peer_checks import loopback_checks, relay_trial_checks
from mosaic_core.doctor.server_checks import ServerAddress, server_checks
from mosaic_core.doctor.whole_checks import WholeWay, whole_checks
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.threads.daemon_call import called_on_daemon
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.finding import Finding, skipped

PLUGIN_TIMEOUT_S = 8.0
WHOLE_TIMEOUT_S = 36.0
"""Only where somebody asks for it: two connections, each measured, and perhaps a robot to be started."""


@dataclass(frozen=True, slots=True)
class Subject:
    """The subject of an examination. ``read``: the robot's YAML file, read before there is an event loop, as that
    imports plugins. ``server_url`` comes before the configuration's own; ``whole_way`` makes what a connection through
    the server needs, from the configuration's server."""

    read: ConfigRead | None = None
    server_url: str = ""
    only: frozenset[str] = frozenset()
    whole_way: Callable[[ServerConfig], WholeWay] | None = None
    resolver: ConnectorResolver | None = None


class Plan:
    """What the doctor examines, and with what. Make it on the event loop that runs the checks."""

    def __init__(self, subject: Subject) -> None:
        self._only = subject.only
        self._read = subject.read
        self._resolver = subject.resolver or ConnectorResolver()
        self._issued = IssuedIceServers()
        server = self._read.server if self._read else None
        self._auth = server.auth if server else None
        self._whole_way = subject.whole_way(server) if subject.whole_way and server else None
        self._own_ice_servers = server.webrtc.ice_servers if server else ()
        url = subject.server_url or (server.ws_url if server else "")
        self._address = ServerAddress(_as_ws_url(url)) if url else None

    @property
    def groups(self) -> tuple[str, ...]:
        """The names of all groups of checks, each once."""
        return tuple(dict.fromkeys(one.name for one in self._every()))

    def checks(self) -> list[CheckRun]:
        """All, or those that are wanted."""
        return [one for one in self._every() if not self._only or one.name in self._only]

    def _every(self) -> list[CheckRun]:
        read = self._read
        return [
            *([] if read is None else [CheckRun("config", lambda: config_checks(read))]),
            *([] if read is None else [CheckRun("code", lambda: code_checks(read))]),
            CheckRun("machine", machine_checks),
            CheckRun("machine", board_checks),
            CheckRun("install", lambda: install_checks(self._resolver)),
            CheckRun("network", address_checks),
            CheckRun("server", self._server),
            CheckRun("ice", self._ice),
            CheckRun("webrtc", loopback_checks, is_heavy=True),
            CheckRun("video", encoder_checks, is_heavy=True),
            CheckRun("machine", loop_lag_check, is_heavy=True),
            CheckRun("relay", self._relay, is_heavy=True),
            *self._whole(),
            *([] if read is None else [CheckRun("device", lambda: device_checks(read))]),
            *self._of_plugins(),
        ]

    async def _server(self) -> AsyncIterator[Finding]:
        if self._address is None:
            self._issued.settle(NO_SERVER)
            yield skipped("server.dns", "No server is known.", "Name the robot's YAML file, or --server.")
            return
        async for finding in server_checks(self._address, self._auth, self._issued):
            yield finding

    async def _ice_servers(self) -> Issued:
        """The robot's own, and then the server's as far as they are known."""
        if self._only and "server" not in self._only:
            async for _ in self._server():
                pass  # for what it issues
        issued = await self._issued.wait()
        return replace(issued, servers=(*self._own_ice_servers, *issued.servers))

    async def _ice(self) -> AsyncIterator[Finding]:
        known = await self._ice_servers()
        async for finding in ice_checks(known.servers, known.unknown_because):
            yield finding

    async def _relay(self) -> AsyncIterator[Finding]:
        servers = (await self._ice_servers()).servers
        if not relays_of(servers):
            yield skipped("relay.connection", "No TURN server is known.")
            return
        async for finding in relay_trial_checks(servers):
            yield finding

    def _whole(self) -> list[CheckRun]:
        way = self._whole_way
        return [] if way is None else [CheckRun("whole", lambda: whole_checks(way), timeout_s=WHOLE_TIMEOUT_S)]

    def _of_plugins(self) -> list[CheckRun]:
        context = CheckContext() if self._read is None else self._read.context(PLUGIN_TIMEOUT_S)
        points = sorted(entry_points(group=CHECKS_GROUP), key=lambda point: point.name)
        return [CheckRun(point.name, _lazily(point, context), timeout_s=PLUGIN_TIMEOUT_S) for point in points]


def _lazily(point: EntryPoint, context: CheckContext) -> Callable[[], AsyncIterator[Finding]]:
    """The plugin is imported within its check, so that one that can't be is a finding."""

    async def start() -> AsyncIterator[Finding]:
        check: Check = await called_on_daemon(point.load, f"doctor-{point.name}")
        async for finding in check(context):
            yield finding

    return start


def _as_ws_url(url: str) -> str:
    """People paste the dashboard's address."""
    scheme, found, rest = url.partition("://")
    if not found:
        return f"wss://{url}"
    return f"{scheme.replace('http', 'ws')}://{rest.partition('/')[0]}"
