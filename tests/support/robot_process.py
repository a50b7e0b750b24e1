"""Runs a robot as a process, and reads what it says of itself every second."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from support.processes import MOSAIC, Process
from support.server_process import Seed, ServerProcess
from support.waiting import PATIENCE_S

CONFIG = """\
version: 1
server:
  ws_url: {ws_url}
  auth: {{ type: simple-token, robot_id: {robot_id}, params: {{ token: {token} }} }}
connectors:
{connectors}"""


def write_config(folder: Path, ws_url: str, seed: Seed, connectors: str) -> Path:
    """The YAML file of the robot of `seed` with these connectors."""
    path = folder / "mosaic_config.yaml"
    words = {"ws_url": ws_url, "robot_id": seed.robot_id, "token": seed.robot_token}
    path.write_text(CONFIG.format(**words, connectors=connectors))
    return path


class RobotProcess(Process):
    """`mosaic run --json` on a YAML file; its snapshots arrive in :attr:`snapshots`, its complaints in :attr:`log`."""

    def __init__(self, config: Path, *options: str) -> None:
        super().__init__([*MOSAIC, "run", str(config), "--json", *options])
        self.snapshots: list[dict[str, Any]] = []

    def read_line(self, line: str) -> None:
        if line.startswith("{"):
            self.snapshots.append(json.loads(line))

    def wait_for(self, predicate: Callable[[dict[str, Any]], bool], what: str, timeout_s: float = PATIENCE_S) -> None:
        """Wait until a snapshot that arrives from now on satisfies `predicate`."""
        seen = len(self.snapshots)
        self.expect(lambda: any(predicate(snapshot) for snapshot in self.snapshots[seen:]), what, timeout_s)

    def wait_until_ready(self, timeout_s: float = PATIENCE_S) -> None:
        self.wait_for(lambda snapshot: snapshot["state"] == "ready", "the robot is ready", timeout_s)


@contextmanager
def running_robot(folder: Path, server: ServerProcess, seed: Seed, connectors: str) -> Iterator[RobotProcess]:
    """The robot of `seed` with these connectors, ready for operators."""
    robot = RobotProcess(write_config(folder, f"ws://127.0.0.1:{server.port}", seed, connectors))
    robot.start()
    try:
        robot.wait_until_ready()
        yield robot
    finally:
        robot.stop()
