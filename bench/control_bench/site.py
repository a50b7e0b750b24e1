"""The processes under test: a server and a robot whose drives write down every command with the time."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

from processes.mosaic import MOSAIC, listening_port, run_mosaic, running

from mosaic_core.operator import MosaicOperator
from mosaic_core.testing.distributions import write_distribution
from mosaic_core.words.signaling import RobotStatus

ROBOT_SIDE = Path(__file__).parents[2] / "tests" / "netlab" / "robot_side"
DRIVES = 10
TIMEOUT_S = 0.1
START_S = 30.0
COMMAND_PERIOD_S = 0.02
POLL_S = 0.002
CONNECTOR = """\
  - type: cmd-vel
    label: drive_{number}
    params: {{ drive: {{ type: callback, function: "drive_recorder:record_{number}" }} }}
    safety: {{ timeout_s: {timeout_s} }}
"""
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: bulk-source, label: bulk, params: {{ rate_mbyteps: 10 }} }}
{drives}"""


@dataclass
class Site:
    """A running server and robot."""

    url: str
    email: str
    password: str
    robot_id: str
    robot_log: Path
    record: Record

    async def sign_in(self) -> MosaicOperator:
        operator = await MosaicOperator.login(self.url, self.email, self.password, is_person=True)
        try:
            await operator.wait_status(self.robot_id, RobotStatus.READY_TO_CONNECT, START_S)
        except TimeoutError:
            raise SystemExit(f"The robot did not get ready:\n{self.robot_log.read_text()[-4000:]}") from None
        return operator


@dataclass
class Record:
    """Follows the file that the drives write."""

    file: Path
    lines: dict[str, list[tuple[float, bool]]] = field(default_factory=dict)
    """Drive → (monotonic s, whether it was told to move), oldest first."""
    told_s: dict[tuple[str, float], float] = field(default_factory=dict)
    """(drive, forward speed) → when it was first told so."""
    _read_bytes: int = 0
    _rest: bytes = b""

    def _read(self) -> None:
        with self.file.open("rb") as file:
            file.seek(self._read_bytes)
            new = file.read()
        self._read_bytes += len(new)
        *whole, self._rest = (self._rest + new).split(b"\n")
        for line in whole:
            name, at_s, *speeds = line.decode().split()
            self.lines.setdefault(name, []).append((float(at_s), any(map(float, speeds))))
            self.told_s.setdefault((name, float(speeds[0])), float(at_s))

    async def stopped_s(self, name: str, since_s: float) -> float:
        """When the drive was first told to stand after ``since_s``; waits for it."""
        ends_at_s = time.monotonic() + START_S
        while not (stands := [at_s for at_s, moves in self._since(name, since_s) if not moves]):
            await self._pause(ends_at_s, f"drive {name} does not stop")
        return stands[-1]

    async def moves(self, name: str, since_s: float, command: Callable[[], object]) -> None:
        """Commands until the drive was told to move after ``since_s``: on a bad path some commands are lost or late."""
        ends_at_s, next_s = time.monotonic() + START_S, since_s
        while not any(moves for _, moves in self._since(name, since_s)):
            if time.monotonic() >= next_s:
                command()
                next_s += COMMAND_PERIOD_S
            await self._pause(ends_at_s, f"drive {name} does not move")

    async def all_told(self, name: str, speeds: Collection[float]) -> list[float]:
        """When the drive was told each of these speeds; waits for all."""
        ends_at_s = time.monotonic() + START_S
        while not all((name, speed) in self.told_s for speed in speeds):
            await self._pause(ends_at_s, f"drive {name} was not told everything")
            self._read()
        return [self.told_s[name, speed] for speed in speeds]

    def last_moved_s(self, name: str, before_s: float) -> float:
        """The newest command to move before ``before_s``."""
        return next(at_s for at_s, moves in reversed(self.lines[name]) if moves and at_s <= before_s)

    def _since(self, name: str, since_s: float) -> Iterator[tuple[float, bool]]:
        """The newest first."""
        self._read()
        return takewhile(lambda line: line[0] >= since_s, reversed(self.lines.get(name, [])))

    @staticmethod
    async def _pause(ends_at_s: float, otherwise: str) -> None:
        if time.monotonic() > ends_at_s:
            raise SystemExit(f"{otherwise} within {START_S} s")
        await asyncio.sleep(POLL_S)


def start_site(folder: Path, stack: ExitStack, network: str | None = None) -> Site:
    """``network``: the profile of a bad network between the robot and its operators."""
    data_dir, ready_file, record = folder / "server", folder / "ready.json", folder / "record.txt"
    folder.mkdir(exist_ok=True)
    record.touch()
    entry_points = {"mosaic.connectors": {"bulk-source": "bulk_source:BulkSourceConfigurer"}}
    write_distribution(folder / "plugin", "bulk-source", entry_points=entry_points)
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    server = stack.enter_context(running(folder / "server.log", *words))
    port = listening_port(ready_file, server, folder / "server.log")
    drives = "".join(CONNECTOR.format(number=number, timeout_s=TIMEOUT_S) for number in range(DRIVES))
    config, robot_log = folder / "mosaic_config.yaml", folder / "robot.log"
    config.write_text(CONFIG.format(port=port, robot_id=seeded["robotId"], token=seeded["robotToken"], drives=drives))
    stack.enter_context(running_robot(config, robot_log, record, network))
    url = f"http://127.0.0.1:{port}"
    return Site(url, seeded["email"], seeded["password"], seeded["robotId"], robot_log, Record(record))


@contextmanager
def running_robot(config: Path, log: Path, record: Path, network: str | None) -> Iterator[None]:
    """`mosaic run` until the end of the block."""
    path = (str(config.parent / "plugin"), str(ROBOT_SIDE), os.environ.get("PYTHONPATH"))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path)), "DRIVE_RECORD": str(record)}
    plain = [*MOSAIC, "run", str(config), "--json"]
    words = plain if network is None else [sys.executable, str(ROBOT_SIDE / "impaired_robot.py"), str(config), network]
    with log.open("wb") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT, env=environment)
        try:
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
