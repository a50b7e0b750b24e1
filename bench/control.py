"""How long a command takes through all gates, and until a robot stands: after silence, and after somebody said stop.
Beside plain aiortc in the same run.

python bench/control.py [STOPS] [--quick] [--under idle cpu bulk network]

Server, robot and operator are processes of their own on loopback. The drive writes down when it was told what; all
processes of a machine have the same monotonic clock. Measured on an idle machine, with as many busy processes as
cores, while the robot sends 10 MB/s of bulk data to the same operator, and over a bad network. The peer sends the same
commands, and the same bulk, over two ordered channels of one connection of plain aiortc.
"""

from __future__ import annotations

import argparse
import asyncio
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from control_bench.figures import Distribution, Report
from control_bench.gates import arrival_us
from control_bench.load import saturated_cpu
from control_bench.plain_peer import PlainOperator, plain_robot
from control_bench.site import COMMAND_PERIOD_S, Site, start_site
from control_bench.stops import AskedFor, Commands, Silence, bulk_beside, half_round_trip_ms
from processes.mosaic import end_like_ctrl_c
from processes.other_end import other_end
from rich.console import Console

from mosaic_core.operator import MosaicOperator, RobotConnection

IDLE, SATURATED, BULK, NETWORK = "idle", "cpu", "bulk", "network"
CONDITIONS = {
    IDLE: "idle",
    SATURATED: "CPU saturated",
    BULK: "10 MB/s bulk",
    NETWORK: "4g: 50 ± 15 ms, 3 % lost",
}
PROFILE = "4g"
COMMAND, LATE, STOP = "command: drive told", "silence: late by", "stop: drive stands"
BULK_MBYTEPS = 10.0
SETTLE_S = 1.0
"""Every load has its effect before anything is measured."""
ALLOWANCE_MS = 20.0
"""Of both promises: on top of `timeout_s`, and on top of half a round trip."""


@dataclass
class Bench:
    operator: MosaicOperator
    connection: RobotConnection
    plain: PlainOperator
    site: Site
    stops: int
    report: Report

    async def under(self, condition: str) -> None:
        async with self._plain_load(condition):
            peer_ms = await self.plain.latencies_ms(self.stops, COMMAND_PERIOD_S)
        async with self._load(condition):
            command_ms = await Commands(self.connection, self.site.record).took_ms(self.stops)
            late_ms = await Silence(self.connection, self.site.record).late_ms(self.stops)
            took_ms = await AskedFor(self.connection, self.site.record).took_ms(self.stops)
        half_ms = await half_round_trip_ms(self.connection)
        idle_ms = ALLOWANCE_MS if condition == IDLE else None
        name = CONDITIONS[condition]
        silence = Distribution(name, LATE, late_ms, "all ≤ 20", idle_ms)
        peer = Distribution(name, "plain aiortc: command", peer_ms)
        stop = Distribution(name, STOP, took_ms, "p99 ≤ RTT/2 + 20", half_ms + ALLOWANCE_MS, 0.99, peer)
        command = Distribution(name, COMMAND, command_ms, peer=peer)
        for one in (command, silence, stop, peer):
            self.report.add(one)

    @asynccontextmanager
    async def _load(self, condition: str) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            if condition == SATURATED:
                stack.enter_context(saturated_cpu())
            if condition == BULK:
                taken = await stack.enter_async_context(bulk_beside(self.operator, self.connection))
                stack.callback(lambda: self._note(f"Bulk that arrived: ours {taken.rate_mbyteps:.1f} MB/s."))
            await asyncio.sleep(SETTLE_S)
            yield

    @asynccontextmanager
    async def _plain_load(self, condition: str) -> AsyncIterator[None]:
        with ExitStack() as stack:
            if condition == SATURATED:
                stack.enter_context(saturated_cpu())
            if condition == BULK:
                self.plain.bulk(BULK_MBYTEPS)
                stack.callback(self.plain.bulk, None)
            await asyncio.sleep(SETTLE_S)
            before, start_s = self.plain.bulk_bytes, asyncio.get_running_loop().time()
            yield
            if condition == BULK:
                elapsed_s = asyncio.get_running_loop().time() - start_s
                self._note(
                    f"Plain aiortc, bulk: {(self.plain.bulk_bytes - before) / elapsed_s / 1e6:.1f} MB/s arrived."
                )

    def _note(self, text: str) -> None:
        self.report.notes.append(text)


async def measure_network(site: Site, stops: int, report: Report) -> None:
    """Half a round trip is the shortest one here: what jitter and loss add to it is in the figures."""
    async with await site.sign_in() as operator:
        connection = await operator.connect(site.robot_id)
        async with await connection.control.take():
            late_ms = await Silence(connection, site.record).late_ms(stops)
            took_ms = await AskedFor(connection, site.record).took_ms(stops)
            half_ms = await half_round_trip_ms(connection)
    report.add(Distribution(CONDITIONS[NETWORK], LATE, late_ms))
    report.add(Distribution(CONDITIONS[NETWORK], STOP, took_ms, f"RTT/2 = {half_ms:.0f}"))


async def measure(site: Site, stops: int, conditions: Sequence[str], report: Report, stack: ExitStack) -> None:
    plain = await PlainOperator.connected(stack.enter_context(other_end(plain_robot)))
    async with await site.sign_in() as operator:
        connection = await operator.connect(site.robot_id)
        async with await connection.control.take():
            for condition in conditions:
                await Bench(operator, connection, plain, site, stops, report).under(condition)
    await plain.close()


def run(stops: int, conditions: Sequence[str], report: Report) -> None:
    near = [condition for condition in conditions if condition != NETWORK]
    with tempfile.TemporaryDirectory() as folder:
        if near:
            with ExitStack() as stack:
                asyncio.run(measure(start_site(Path(folder) / "near", stack), stops, near, report, stack))
        if NETWORK in conditions:
            with ExitStack() as stack:
                asyncio.run(measure_network(start_site(Path(folder) / "far", stack, PROFILE), stops, report))


def main() -> None:
    end_like_ctrl_c()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stops", nargs="?", type=int, default=300, help="of each kind, under each load")
    parser.add_argument("--quick", action="store_true", help="20 of each: does it work at all?")
    parser.add_argument("--under", nargs="+", choices=list(CONDITIONS), default=list(CONDITIONS), help="which loads")
    asked = parser.parse_args()
    report = Report()
    try:
        run(20 if asked.quick else asked.stops, asked.under, report)
    except KeyboardInterrupt:
        raise SystemExit("interrupted") from None
    report.notes.append(
        f"The gates that are asked on arrival: {arrival_us():.1f} µs of the event loop for each command."
    )
    console = Console(width=120)
    console.print(report.table("Milliseconds until the robot stands"))
    for note in report.notes:
        console.print(note)
    if report.missed:
        raise SystemExit(f"{len(report.missed)} promises missed")


if __name__ == "__main__":
    main()
