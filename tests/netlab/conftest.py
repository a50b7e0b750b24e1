"""A laboratory of real networks: robot, router with the server, and operator in network namespaces of their own.

    robot ── veth ── router (server, forwards) ── veth ── operator

Data between robot and operator is forwarded by the router, which can be told to swallow it, each way by itself; both
still reach the server. Needs root (CAP_NET_ADMIN, CAP_SYS_ADMIN). The drive of the robot writes down every command with
the time; the clock is the same in all processes of a machine.
"""

from __future__ import annotations

import asyncio
import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator, Sequence
from contextlib import ExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

import pytest
from httpx import AsyncClient

from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.testing.distributions import write_distribution

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
ROBOT_SIDE = Path(__file__).parent / "robot_side"
START_S = 30.0
CLONE_NEWNET = 0x40000000
ROBOT_IP, ROUTER_ROBOT_IP = "10.77.1.2", "10.77.1.1"
OPERATOR_IP, ROUTER_OPERATOR_IP = "10.77.2.2", "10.77.2.1"
"""Inside the namespaces only: two runs at the same time don't see each other."""
CONNECTORS = """\
  - type: cmd-vel
    label: cmd_vel
    params: { drive: { type: callback, function: "drive_recorder:record_base" } }
    safety: { timeout_s: 0.3 }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
  - { type: blocker, label: blocker }
  - { type: bulk-source, label: bulk, params: { rate_mbyteps: 10 } }
"""
TWIST = {"linear": {"x": 0.4}, "angular": {"z": 0.2}}
_numbers = count()
T = TypeVar("T")


# -- networks ----------------------------------------------------------------------------------------------------------


def ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True)
    if done.returncode != 0:
        raise OSError(f"ip {' '.join(words)}: {done.stderr.strip()}")


@dataclass(frozen=True)
class Namespace:
    """A network of its own, named after this process."""

    name: str

    @property
    def prefix(self) -> list[str]:
        """What a command line begins with to run in here."""
        return ["ip", "netns", "exec", self.name]

    def run(self, work: Callable[[], T]) -> T:
        """``work()`` on a thread in here; sockets, threads and processes that it makes are in here too."""
        found: list[T] = []
        failed: list[BaseException] = []

        def inside() -> None:
            try:
                self._enter()
                found.append(work())
            except BaseException as error:  # noqa: BLE001 (raised where somebody waits for it)
                failed.append(error)

        thread = threading.Thread(target=inside, name=f"in-{self.name}")
        thread.start()
        thread.join()
        if failed:
            raise failed[0]
        return found[0]

    def _enter(self) -> None:
        """This thread only. `os.setns` came with Python 3.12."""
        with Path("/run/netns", self.name).open() as namespace:
            if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), CLONE_NEWNET) != 0:
                raise OSError(ctypes.get_errno(), f"setns to {self.name}")


class Lab:
    """The three networks and the two cables between them."""

    def __init__(self, stack: ExitStack) -> None:
        run = f"mosaic-{os.getpid()}-{next(_numbers)}"
        self.robot, self.router, self.operator = (Namespace(f"{run}-{who}") for who in ("robot", "router", "operator"))
        for namespace in (self.robot, self.router, self.operator):
            ip("netns", "add", namespace.name)
            stack.callback(ip, "netns", "del", namespace.name)
            ip("-n", namespace.name, "link", "set", "lo", "up")
        self._connect(self.robot, "robot", ROBOT_IP, ROUTER_ROBOT_IP)
        self._connect(self.operator, "operator", OPERATOR_IP, ROUTER_OPERATOR_IP)
        self.router.run(lambda: Path("/proc/sys/net/ipv4/ip_forward").write_text("1"))
        self._cut: list[str] = []

    def _connect(self, namespace: Namespace, port: str, address: str, router_address: str) -> None:
        router = self.router.name
        ip("-n", router, "link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", namespace.name)
        ip("-n", router, "addr", "add", f"{router_address}/24", "dev", port)
        ip("-n", router, "link", "set", port, "up")
        ip("-n", namespace.name, "addr", "add", f"{address}/24", "dev", "eth0")
        ip("-n", namespace.name, "link", "set", "eth0", "up")
        ip("-n", namespace.name, "route", "add", "default", "via", router_address)

    def cut(self, *, to_robot: bool = True, to_operator: bool = True) -> None:
        """From now on the router swallows what it should forward; nobody is told, as on a bad radio link.

        The server is cut off too from the side whose packets vanish.
        """
        for address, is_cut in ((ROBOT_IP, to_robot), (OPERATOR_IP, to_operator)):
            if is_cut:
                ip("-n", self.router.name, "route", "add", "blackhole", f"{address}/32")
                self._cut.append(address)

    def heal(self) -> None:
        while self._cut:
            ip("-n", self.router.name, "route", "del", "blackhole", f"{self._cut.pop()}/32")


@pytest.fixture(scope="session")
def lab() -> Iterator[Lab]:
    """Skipped (in CI: fails) where networks can't be made."""
    if shutil.which("ip") is None:
        pytest.skip("no `ip`: apt install iproute2")
    with ExitStack() as stack:
        try:
            made = Lab(stack)
        except OSError as error:
            pytest.skip(f"network namespaces can't be made here, run as root: {error}")
        yield made
        made.heal()


# -- processes ---------------------------------------------------------------------------------------------------------


@dataclass
class Process:
    """A process of ours in one of the networks, with what it wrote."""

    words: Sequence[str]
    environment: dict[str, str] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)
    process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self.process = subprocess.Popen(
            self.words,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, **self.environment},
        )
        threading.Thread(target=self._drain, daemon=True).start()

    def _drain(self) -> None:
        assert self.process is not None
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            self.log.extend(line.rstrip() for line in lines)

    def stop(self) -> None:
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait(timeout=5)


@dataclass
class Track:
    """What the robot's drives were told: ``(monotonic s, whether to move)``, oldest first."""

    file: Path

    def lines(self, since_s: float = 0.0, name: str = "base") -> list[tuple[float, bool]]:
        whole, _, _ = self.file.read_text().rpartition("\n")
        rows = [line.split() for line in whole.splitlines()]
        return [
            (float(at_s), any(map(float, speeds)))
            for drive, at_s, *speeds in rows
            if drive == name and float(at_s) >= since_s
        ]

    def speeds_mps(self, since_s: float, name: str = "base") -> list[float]:
        """How fast it was told to drive."""
        whole, _, _ = self.file.read_text().rpartition("\n")
        rows = [line.split() for line in whole.splitlines()]
        return [float(linear) for drive, at_s, linear, _ in rows if drive == name and float(at_s) >= since_s]

    def moves(self, since_s: float = 0.0) -> list[float]:
        """When it was told to move."""
        return [at_s for at_s, is_move in self.lines(since_s) if is_move]

    def stands(self) -> bool:
        return not self.lines()[-1:] or not self.lines()[-1][1]

    def stopped_s(self, since_s: float) -> float:
        """When it was first told to stand after ``since_s``, which it was: wait for that before."""
        return min(at_s for at_s, is_move in self.lines(since_s) if not is_move)

    def has_stopped(self, since_s: float) -> bool:
        return any(not is_move for _, is_move in self.lines(since_s))

    def silence_s(self) -> float:
        """From the last command that moved it to the standstill after it."""
        last_s = self.moves()[-1]
        return self.stopped_s(last_s) - last_s


@dataclass
class Site:
    """A server and a robot in the lab, and operators who join them."""

    lab: Lab
    url: str
    account: dict[str, str]
    robot: Process
    track: Track

    def on_operators_side(self, body: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Runs ``body`` on an event loop in the operator's network."""
        self.lab.operator.run(lambda: asyncio.run(body()))

    @asynccontextmanager
    async def connected(
        self, email: str | None = None, password: str | None = None, *, is_person: bool = True, **options: Any
    ) -> AsyncIterator[RobotConnection]:
        """Somebody at the robot; without an account its owner, who is a supervisor."""
        token = await self._token(email or self.account["email"], password or self.account["password"])
        async with MosaicOperator(self.url, token, is_person=is_person, **options) as operator:
            yield await operator.connect(self.account["robotId"], timeout_s=20)

    async def colleague(self, role: str) -> tuple[str, str]:
        """E-mail and password of a new account that has this role on the robot."""
        token = await self._token(self.account["email"], self.account["password"])
        email = f"{role}-{next(_numbers)}@example.org"
        async with AsyncClient(base_url=self.url, headers={"Authorization": f"Bearer {token}"}) as http:
            made = await http.post("/api/v1/users", json={"email": email, "fullName": role.title()})
            account = made.raise_for_status().json()["resultData"]
            path = f"/api/v1/robots/{self.account['robotId']}/grants/{account['id']}"
            (await http.put(path, json={"role": role})).raise_for_status()
        return email, account["password"]

    async def _token(self, email: str, password: str) -> str:
        async with await MosaicOperator.login(self.url, email, password) as signed_in:
            return signed_in.access_token

    @asynccontextmanager
    async def driving(self, connection: RobotConnection, label: str = "cmd_vel") -> AsyncIterator[None]:
        """Commands 20 times a second, whatever happens; the robot moves."""
        pad = connection.sendable(label)
        await pad.wait_open()
        start_s = time.monotonic()

        async def drive() -> None:
            while True:
                pad.send_json(TWIST)
                await asyncio.sleep(0.05)

        task = asyncio.create_task(drive())
        try:
            await until(lambda: len(self.track.moves(start_s)) >= 3, "the robot moves")
            yield
        finally:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


def _start_server(lab: Lab, folder: Path, stack: ExitStack, wait_for: Callable[..., float]) -> tuple[int, Any]:
    words = ["server", "seed", "--data-dir", str(folder), "--robot-name", "Lab robot", "--json"]
    done = subprocess.run([*MOSAIC, *words], capture_output=True, text=True, timeout=START_S)
    assert done.returncode == 0, done.stderr
    ready = folder / "ready.json"
    words = ["server", "run", "--host", "0.0.0.0", "--port", "0", "--insecure-public", "--data-dir", str(folder)]  # noqa: S104
    hosts = [word for address in (ROUTER_ROBOT_IP, ROUTER_OPERATOR_IP) for word in ("--allow-host", address)]
    server = Process([*lab.router.prefix, *MOSAIC, *words, *hosts, "--ready-file", str(ready)])
    stack.callback(server.stop)
    server.start()
    wait_for(
        lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=server.process, log=server.log
    )
    return json.loads(ready.read_text())["port"], json.loads(done.stdout)


@pytest.fixture(scope="session")
def whole_site(
    lab: Lab,
    tmp_path_factory: pytest.TempPathFactory,
    wait_for: Callable[..., float],
) -> Iterator[Site]:
    """One for all tests: what one of them does to the robot, it must survive for the next."""
    folder = tmp_path_factory.mktemp("lab")
    write_distribution(
        folder,
        "bad-plugin",
        entry_points={
            "mosaic.connectors": {
                "blocker": "bad_plugin:BlockerConfigurer",
                "bulk-source": "bulk_source:BulkSourceConfigurer",
            }
        },
    )
    record = folder / "record.txt"
    record.touch()
    with ExitStack() as stack:
        port, account = _start_server(lab, folder, stack, wait_for)
        config = folder / "mosaic_config.yaml"
        config.write_text(
            f"""\
version: 1
server:
  ws_url: ws://{ROUTER_ROBOT_IP}:{port}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
{CONNECTORS}"""
        )
        path = os.pathsep.join(filter(None, (str(folder), str(ROBOT_SIDE), os.environ.get("PYTHONPATH"))))
        environment = {"PYTHONPATH": path, "DRIVE_RECORD": str(record)}
        robot = Process([*lab.robot.prefix, *MOSAIC, "run", str(config), "--json"], environment)
        stack.callback(robot.stop)
        robot.start()
        wait_for(
            lambda: any('"state": "ready"' in line or '"state":"ready"' in line for line in robot.log),
            "the robot is ready",
            alive=robot.process,
            log=robot.log,
        )
        yield Site(lab, f"http://{ROUTER_OPERATOR_IP}:{port}", account, robot, Track(record))


@pytest.fixture
def site(whole_site: Site, wait_for: Callable[..., float]) -> Iterator[Site]:
    """The robot stands; whatever the test cut is whole again afterwards."""
    wait_for(whole_site.track.stands, "the robot stands before the test")
    yield whole_site
    whole_site.lab.heal()


async def until(condition: Callable[[], bool], what: str, timeout_s: float = 10.0) -> None:
    """For files of other processes, which tell nobody that they changed."""
    ends_at_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < ends_at_s, f"after {timeout_s} s still not true: {what}"
        await asyncio.sleep(0.01)


@pytest.fixture(name="until", scope="session")
def until_fixture() -> Callable[..., Coroutine[Any, Any, None]]:
    return until
