"""The demo's server: seeded and started as a child, spoken to over its REST interface."""

from __future__ import annotations

import importlib.metadata
import json
import os
import socket
import ssl
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx

from mosaic_sim.demo.child import Child, mosaic_command
from mosaic_sim.demo.errors import DemoFailed

HOST = "127.0.0.1"
USUAL_PORT = 9001
START_PATIENCE_S = 90.0
"""A first start compiles every module; on a small or busy board that takes a while."""
POLL_S = 0.1
ROBOT_NAME = "Simulated robot"
_NOBODY = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
"""Whom to trust where there is no TLS: to read all that a system trusts takes 20 ms of a processor for each call."""


@dataclass(frozen=True, slots=True)
class Seed:
    """The objects that ``mosaic server seed`` made: the throw-away account and robot."""

    email: str
    password: str
    robot_id: str
    robot_token: str


def check_server_is_installed() -> None:
    """Raise :class:`DemoFailed` with what to install if there is no ``mosaic server``."""
    try:
        importlib.metadata.distribution("mosaic-server")
    except importlib.metadata.PackageNotFoundError:
        raise DemoFailed(
            "the demo needs the server, which is a distribution of its own", 'pip install "mosaic-sim[demo]"'
        ) from None


def chosen_port(wanted: int | None) -> int:
    """The wanted port, or :class:`DemoFailed` if it is taken; without a wish the usual one, or 0 (any free one)."""
    port = USUAL_PORT if wanted is None else wanted
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            if wanted is None:
                return 0
            other = port + 1 if port < 65535 else port - 1
            cure = f"choose another one, `mosaic demo --port {other}`, or leave --port out"
            raise DemoFailed(f"port {port} of {HOST} can't be used: {error.strerror}", cure) from None
    return port


def seeded(data_dir: Path) -> Seed:
    """Make the throw-away database."""
    command = mosaic_command("server", "seed", "--data-dir", str(data_dir), "--json", "--robot-name", ROBOT_NAME)
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=START_PATIENCE_S)
    if done.returncode != 0:
        raise DemoFailed("the server's throw-away database could not be made", details=done.stderr.strip())
    record = json.loads(done.stdout)
    return Seed(record["email"], record["password"], record["robotId"], record["robotToken"])


class DemoServer:
    """The running server; makes sign-in codes and knows whether the robot is there."""

    def __init__(self, data_dir: Path, port: int, environment: Mapping[str, str] | None = None) -> None:
        """``environment``: where it finds the widgets of plugins that are not installed."""
        self._ready_file = data_dir / "ready.json"
        command = mosaic_command(
            "server", "run", "--data-dir", str(data_dir), "--host", HOST, "--port", str(port),
            "--ready-file", str(self._ready_file), "--log-level", "warning",
        )  # fmt: skip
        self.child = Child("server", command, data_dir / "server.log", environment)
        self.url = ""
        self._token = ""

    def wait_until_listening(self) -> None:
        self._wait(lambda: self._ready_file.exists() and bool(self._ready_file.read_text().strip()), "does not listen")
        self.url = f"http://{HOST}:{json.loads(self._ready_file.read_text())['port']}"

    def sign_in(self, seed: Seed) -> None:
        credentials = {"username": seed.email, "password": seed.password}
        self._token = self._call("POST", "/api/v1/account/login/access-token", credentials)["accessToken"]

    def one_time_code(self) -> tuple[str, datetime]:
        """For the browser: works once, until the time that is told with it."""
        issued = self._call("POST", "/api/v1/account/one-time-code")
        return str(issued["code"]), datetime.now(UTC) + timedelta(seconds=float(issued["expiresInS"]))

    def wait_for_robot(self, robot_id: str, robot: Child) -> None:
        def is_online() -> bool:
            robot.check_alive()
            robots = self._call("GET", "/api/v1/robots")["data"]
            return any(one["id"] == robot_id and one.get("isOnline") for one in robots)

        self._wait(is_online, "does not see the robot", details=robot.last_lines)

    def _wait(self, is_done: Callable[[], bool], problem: str, details: Callable[[], str] | None = None) -> None:
        deadline_s = time.monotonic() + START_PATIENCE_S
        while not is_done():
            self.child.check_alive()
            if time.monotonic() > deadline_s:
                text = (details or self.child.last_lines)()
                raise DemoFailed(f"the server {problem} after {START_PATIENCE_S:g} s", details=text)
            time.sleep(POLL_S)

    def _call(self, method: str, path: str, body: dict[str, str] | None = None) -> Any:
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            # trust_env: a proxy named in the environment can't reach our loopback.
            with httpx.Client(base_url=self.url, trust_env=False, verify=_NOBODY, timeout=10.0) as client:
                response = client.request(method, path, json=body, headers=headers)
            response.raise_for_status()
            return response.json()["resultData"]
        except (httpx.HTTPError, ValueError, KeyError) as error:
            self.child.check_alive()
            raise DemoFailed(f"the server's answer to {path} makes no sense: {error}") from error


def robot_environment(server_url: str, seed: Seed) -> dict[str, str]:
    """What the robot's ``robot.yaml`` reads; its token stands in no file and on no command line."""
    return {
        "MOSAIC_WS_URL": server_url.replace("http", "ws", 1),
        "MOSAIC_ROBOT_ID": seed.robot_id,
        "MOSAIC_TOKEN": seed.robot_token,
        "PYTHONUNBUFFERED": os.environ.get("PYTHONUNBUFFERED", "1"),
    }
