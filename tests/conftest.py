"""Real processes for tests that need them: a server, robots, and where to find Chromium."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
START_S = 30.0
QUIET = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@dataclass
class Seed:
    """The account and robot of a throw-away database."""

    email: str
    password: str
    robot_id: str
    robot_token: str


@dataclass
class ServerProcess:
    """`mosaic server run` on a free port with a data directory of its own; it may be stopped and started again."""

    data_dir: Path
    port: int = 0
    process: subprocess.Popen[str] | None = None
    log: list[str] = field(default_factory=list)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def seed(self, robot_name: str) -> Seed:
        words = ["server", "seed", "--data-dir", str(self.data_dir), "--robot-name", robot_name, "--json"]
        done = subprocess.run([*MOSAIC, *words], capture_output=True, text=True, timeout=START_S)
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        return Seed(found["email"], found["password"], found["robotId"], found["robotToken"])

    def start(self) -> None:
        ready = self.data_dir / "ready.json"
        ready.unlink(missing_ok=True)
        words = [
            "server",
            "run",
            "--data-dir",
            str(self.data_dir),
            "--port",
            str(self.port),
            "--ready-file",
            str(ready),
        ]
        self.process = subprocess.Popen([*MOSAIC, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        _collect(self.process, self.log.append)
        wait_for(
            lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=self.process, log=self.log
        )
        self.port = json.loads(ready.read_text())["port"]

    def stop(self) -> None:
        if self.process is not None:
            _end(self.process)


@dataclass
class RobotProcess:
    """`mosaic run --json` on a YAML file; its snapshots arrive in :attr:`snapshots`."""

    config: Path
    process: subprocess.Popen[str] | None = None
    snapshots: list[dict[str, Any]] = field(default_factory=list)
    log: list[str] = field(default_factory=list)

    def start(self) -> None:
        words = [*MOSAIC, "run", str(self.config), "--json"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        _collect(self.process, self._read)
        threading.Thread(target=_drain, args=(self.process.stderr, self.log.append), daemon=True).start()

    def _read(self, line: str) -> None:
        if line.startswith("{"):
            self.snapshots.append(json.loads(line))

    def wait_for(self, predicate: Callable[[dict[str, Any]], bool], what: str, timeout_s: float = START_S) -> None:
        """Wait until a snapshot that arrives from now on satisfies `predicate`."""
        seen = len(self.snapshots)
        assert self.process is not None
        wait_for(
            lambda: any(predicate(snapshot) for snapshot in self.snapshots[seen:]),
            what,
            timeout_s,
            alive=self.process,
            log=self.log,
        )

    def stop(self) -> int:
        assert self.process is not None
        return _end(self.process)

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait(timeout=5)


def _collect(process: subprocess.Popen[str], take: Callable[[str], None]) -> None:
    threading.Thread(target=_drain, args=(process.stdout, take), daemon=True).start()


def _drain(stream: Any, take: Callable[[str], None]) -> None:
    with stream:
        for line in stream:
            take(line.rstrip())


def _end(process: subprocess.Popen[str]) -> int:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(timeout=5)
    assert process.returncode is not None
    return process.returncode


def wait_for(
    condition: Callable[[], bool],
    what: str,
    timeout_s: float = START_S,
    *,
    alive: subprocess.Popen[str] | None = None,
    log: list[str] | None = None,
) -> float:
    """Poll until `condition` holds; returns the seconds it took, fails the test with `what` otherwise."""
    start = time.monotonic()
    while not condition():
        tail = "\n".join((log or [])[-25:])
        if alive is not None and alive.poll() is not None:
            pytest.fail(f"the process ended with {alive.returncode} while waiting until {what}\n{tail}")
        if time.monotonic() - start > timeout_s:
            pytest.fail(f"after {timeout_s} s still not true: {what}\n{tail}")
        time.sleep(0.02)
    return time.monotonic() - start


@pytest.fixture(name="wait_for", scope="session")
def wait_for_fixture() -> Callable[..., float]:
    return wait_for


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    running = ServerProcess(tmp_path_factory.mktemp("server"))
    yield running
    running.stop()


@pytest.fixture(scope="module")
def seed(server: ServerProcess) -> Seed:
    """A seeded and started server's account and robot."""
    seeded = server.seed("Test robot")
    server.start()
    return seeded


@pytest.fixture(scope="module")
def start_robot(server: ServerProcess, seed: Seed, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """`start_robot(connectors_yaml)` → a running robot that is ready for operators."""
    robots: list[RobotProcess] = []

    def start(connectors: str, *, wait: bool = True) -> RobotProcess:
        config = tmp_path_factory.mktemp("robot") / "mosaic_config.yaml"
        config.write_text(
            f"""\
version: 1
server:
  ws_url: ws://127.0.0.1:{server.port}
  auth:
    type: simple-token
    robot_id: {seed.robot_id}
    params: {{ token: {seed.robot_token} }}
connectors:
{connectors}"""
        )
        robot = RobotProcess(config)
        robots.append(robot)
        robot.start()
        if wait:
            robot.wait_for(lambda snapshot: snapshot["state"] == "ready", "the robot is ready")
        return robot

    yield start
    for robot in robots:
        robot.stop()


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of a Chromium or Chrome; the test is skipped (in CI: fails) where there is none."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    found = os.environ.get("MOSAIC_CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip("no Chromium: apt install chromium, or name one in MOSAIC_CHROMIUM")
    return found


@pytest.fixture(scope="session")
def quiet_words() -> list[str]:
    """What a Chromium of ours is started with: no window, no graphics card, no talk with its maker."""
    return QUIET


@pytest.fixture(scope="session")
def playwright(chromium: str) -> Iterator[Playwright]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright, chromium: str) -> Iterator[Browser]:
    running = playwright.chromium.launch(executable_path=chromium, args=QUIET)
    yield running
    running.close()
