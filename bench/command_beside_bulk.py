"""How late are commands while bulk data saturates the link? With the second peer connection, with the send scheduler
alone, and over plain aiortc with everything on one association.

python bench/command_beside_bulk.py [--rounds N] [--commands N] [--only bulk scheduler plain]

Server, robot and operator are processes of their own on one machine, whose processes have the same monotonic clock.
50 commands a second travel unordered and unrepeated; the robot's handler answers each with the time at which it came.
Ways alternate within each round; the percentiles of each round are taken first, then their medians over the rounds.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import os
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from bulk_bench.plain import PlainOperator, plain_robot
from processes.mosaic import listening_port, run_mosaic, running
from processes.other_end import other_end
from rich.console import Console
from rich.table import Table

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.testing.distributions import write_distribution
from mosaic_core.words.signaling import RobotStatus

COMMAND_PERIOD_S = 0.02
SETTLE_S = 1.0
START_S = 30.0
WAYS = {"bulk": "second connection for bulk", "scheduler": "scheduler alone", "plain": "plain aiortc"}
PROMISE = 2.0
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: command-echo, label: command }}
  - {{ type: bulk-flood, label: bulk }}
"""
PLUGIN = {"command-echo": "bulk_bench.connectors:EchoConfigurer", "bulk-flood": "bulk_bench.connectors:FloodConfigurer"}


class Operator(Protocol):
    """One way to command and to be flooded."""

    bulk_bytes: int
    heard: Callable[[dict[str, Any]], None] | None

    def send(self, value: dict[str, Any]) -> None: ...
    async def flood(self, on: bool) -> None: ...


class OurOperator:
    """A connected Python operator."""

    def __init__(self, operator: MosaicOperator, connection: RobotConnection) -> None:
        self.bulk_bytes = 0
        self.heard: Callable[[dict[str, Any]], None] | None = None
        self._operator = operator
        self._connection = connection
        self._command = connection.bidirectional("command")
        self._command.subscribe(lambda data, info: self._heard())

    async def open(self) -> None:
        await self._command.wait_open()

    def send(self, value: dict[str, Any]) -> None:
        self._command.send_json(value)

    async def flood(self, on: bool) -> None:
        store = self._connection.receivable("bulk")
        if on:
            store.subscribe(self._took)
            await store.wait_open()
            return
        for _ in range(2):  # this call's hold and the other one's
            self._operator.stores.release_store(store.robot_connector)

    def _heard(self) -> None:
        if self.heard is not None and self._command.latest is not None:
            self.heard(self._command.latest.json())

    def _took(self, data: bytes) -> None:
        self.bulk_bytes += len(data)


@dataclass
class Latencies:
    """Milliseconds of one round under one load."""

    command_ms: list[float] = field(default_factory=list)
    telemetry_ms: list[float] = field(default_factory=list)
    round_trip_ms: list[float] = field(default_factory=list)
    lost: int = 0
    mbyteps: float = 0.0


async def measured(operator: Operator, commands: int) -> Latencies:
    """Send commands and take the answers."""
    found = Latencies()
    sent_s: dict[int, float] = {}

    def heard(answer: dict[str, Any]) -> None:
        now_s, at_s = time.monotonic(), sent_s.pop(answer["number"], None)
        if at_s is not None:
            found.command_ms.append(1000 * (answer["came_s"] - at_s))
            found.telemetry_ms.append(1000 * (now_s - answer["came_s"]))
            found.round_trip_ms.append(1000 * (now_s - at_s))

    operator.heard = heard
    begin_s, before_bytes = time.monotonic(), operator.bulk_bytes
    for number in range(commands):
        sent_s[number] = time.monotonic()
        operator.send({"number": number})
        await asyncio.sleep(max(0.0, begin_s + (number + 1) * COMMAND_PERIOD_S - time.monotonic()))
    found.mbyteps = (operator.bulk_bytes - before_bytes) / (time.monotonic() - begin_s) / 1e6
    await asyncio.sleep(0.5)
    found.lost = len(sent_s)
    operator.heard = None
    return found


@dataclass
class Figures:
    """Of one way, round by round."""

    idle: list[Latencies] = field(default_factory=list)
    loaded: list[Latencies] = field(default_factory=list)

    async def take(self, operator: Operator, commands: int) -> None:
        self.idle.append(await measured(operator, commands))
        await operator.flood(True)
        await asyncio.sleep(SETTLE_S)
        self.loaded.append(await measured(operator, commands))
        await operator.flood(False)


def percentile(values: Sequence[float], share: float) -> float:
    """The nearest rank."""
    return sorted(values)[max(1, math.ceil(share * len(values))) - 1] if values else float("nan")


def median_of(rounds: Sequence[Latencies], what: str, share: float) -> float:
    return statistics.median(percentile(getattr(one, what), share) for one in rounds)


class Bench:
    def __init__(self, folder: Path, stack: ExitStack, ways: Sequence[str], commands: int) -> None:
        self.figures = {way: Figures() for way in ways}
        self._commands = commands
        self._log = folder / "robot.log"
        seeded = run_server_and_robot(folder, stack)
        self._url, self._account = seeded[0], seeded[1]

    async def round(self) -> None:
        for way in self.figures:
            async with self._operator(way) as operator:
                await self.figures[way].take(operator, self._commands)

    @asynccontextmanager
    async def _operator(self, way: str) -> AsyncIterator[Operator]:
        async with AsyncExitStack() as stack:
            if way == "plain":
                plain = await PlainOperator.connected(stack.enter_context(other_end(plain_robot)))
                stack.push_async_callback(plain.close)
                yield plain
                return
            operator = await MosaicOperator.login(self._url, self._account["email"], self._account["password"])
            await stack.enter_async_context(operator)
            operator.uses_bulk_lane = way == "bulk"
            robot_id = self._account["robotId"]
            try:
                await operator.wait_status(robot_id, RobotStatus.READY_TO_CONNECT, START_S)
            except TimeoutError:
                raise SystemExit(f"The robot did not get ready:\n{self._log.read_text()[-4000:]}") from None
            ours = OurOperator(operator, await operator.connect(robot_id))
            await ours.open()
            yield ours


def run_server_and_robot(folder: Path, stack: ExitStack) -> tuple[str, dict[str, str]]:
    """Their processes, until the end; the server's URL and who may sign in."""
    data_dir, ready_file = folder / "server", folder / "ready.json"
    write_distribution(folder / "plugin", "bulk-bench", entry_points={"mosaic.connectors": PLUGIN})
    os.environ["PYTHONPATH"] = os.pathsep.join(
        [str(folder / "plugin"), str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    )
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    server = stack.enter_context(running(folder / "server.log", *words))
    port = listening_port(ready_file, server, folder / "server.log")
    config = folder / "mosaic_config.yaml"
    config.write_text(CONFIG.format(port=port, robot_id=seeded["robotId"], token=seeded["robotToken"]))
    stack.enter_context(running(folder / "robot.log", "run", str(config), "--json"))
    return f"http://127.0.0.1:{port}", seeded


def table(figures: dict[str, Figures]) -> Table:
    shown = Table(title="Commands at 50 Hz, milliseconds p50 / p99")
    for column in (
        "way",
        "bulk MB/s",
        "command idle",
        "beside bulk",
        "x idle p99",
        "telemetry idle",
        "beside",
        "x idle",
        "lost",
    ):
        shown.add_column(column, justify="left" if column == "way" else "right")
    for way, found in figures.items():
        cells = [f"{statistics.median(one.mbyteps for one in found.loaded):.1f}"]
        for what in ("command_ms", "telemetry_ms"):
            ranks = [[median_of(rounds, what, share) for share in (0.5, 0.99)] for rounds in (found.idle, found.loaded)]
            cells += [f"{low:.1f} / {high:.1f}" for low, high in ranks]
            cells.append(f"{ranks[1][1] / ranks[0][1]:.1f}")
        shown.add_row(WAYS[way], *cells, str(sum(one.lost for one in found.loaded)))
    return shown


async def main(arguments: argparse.Namespace) -> int:
    console = Console()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        bench = Bench(Path(folder), stack, arguments.only, arguments.commands)
        for _ in range(arguments.rounds):
            await bench.round()
        console.print(table(bench.figures))
    if "bulk" not in bench.figures:
        return 0
    bulk = bench.figures["bulk"]
    ratio = median_of(bulk.loaded, "command_ms", 0.99) / median_of(bulk.idle, "command_ms", 0.99)
    console.print(f"Promised: command p99 beside bulk ≤ {PROMISE:.0f} x idle; found {ratio:.1f}.")
    return 0 if ratio <= PROMISE else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, metavar="N")
    parser.add_argument("--commands", type=int, default=200, metavar="N", help="per round and load")
    parser.add_argument("--only", nargs="*", choices=list(WAYS), default=list(WAYS))
    sys.exit(run_event_loop(main(parser.parse_args())))
