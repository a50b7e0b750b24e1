"""A robot that sends six times what its link takes: does its memory stay flat, and the newest value young?

python bench/outrun.py [--minutes M] [--rate MBPS]

Server, robot and operator are real and processes of their own; the path between the two is a router in user space with
10 ms each way and half a second of queue. Memory is the robot's resident set, looked at every second after a warm-up.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import statistics
import subprocess
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from data_bench.connectors import STAMP
from processes.mosaic import listening_port, run_mosaic, running
from rich.console import Console
from rich.table import Table

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.laboratory.impaired_offerer import impaired_operator
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.operator import MosaicOperator
from mosaic_core.operator.mosaic_operator import LOGIN_ROUTE
from mosaic_core.operator.signaling.rest_api import log_in
from mosaic_core.testing.distributions import write_distribution
from mosaic_core.words.signaling import RobotStatus

START_S = 30.0
WARM_UP_SHARE = 0.1
PLUGIN = {
    "newest": "data_bench.connectors:NewestConfigurer",
    "events": "data_bench.connectors:EventsConfigurer",
    "maps": "data_bench.connectors:MapsConfigurer",
}
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: newest, label: newest }}
  - {{ type: events, label: events }}
  - {{ type: maps, label: maps }}
"""


@dataclass
class Found:
    """``ages_s``: of each newest value when it came."""

    ages_s: list[float] = field(default_factory=list)
    rss_mb: list[float] = field(default_factory=list)
    arrived_bytes: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Site:
    url: str
    account: dict[str, str]
    robot: subprocess.Popen[bytes]
    log: Path


def started_site(folder: Path, stack: ExitStack) -> Site:
    data_dir, ready_file = folder / "server", folder / "ready.json"
    write_distribution(folder / "plugin", "outrun-bench", entry_points={"mosaic.connectors": PLUGIN})
    known = os.environ.get("PYTHONPATH")
    paths = [str(folder / "plugin"), str(Path(__file__).parent), *([known] if known else [])]
    os.environ["PYTHONPATH"] = os.pathsep.join(paths)
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    server = stack.enter_context(running(folder / "server.log", *words))
    port = listening_port(ready_file, server, folder / "server.log")
    config = folder / "mosaic_config.yaml"
    config.write_text(CONFIG.format(port=port, robot_id=seeded["robotId"], token=seeded["robotToken"]))
    robot = stack.enter_context(running(folder / "robot.log", "run", str(config), "--json"))
    return Site(f"http://127.0.0.1:{port}", seeded, robot, folder / "robot.log")


def rss_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


async def outrun(site: Site, path: ImpairedPath, seconds: float) -> Found:
    found, warm_until_s = Found(), time.monotonic() + seconds * WARM_UP_SHARE

    def came(label: str, data: bytes) -> None:
        now_s = time.monotonic()
        if now_s < warm_until_s:
            return
        found.arrived_bytes += len(data)
        if label == "newest":
            found.ages_s.append(now_s - STAMP.unpack_from(data)[0])

    credentials = {"username": site.account["email"], "password": site.account["password"]}
    token = await log_in(site.url, LOGIN_ROUTE, credentials)
    operator = MosaicOperator(site.url, token, make_offerer=impaired_operator(AiortcOfferer, path))
    async with operator:
        await operator.wait_status(site.account["robotId"], RobotStatus.READY_TO_CONNECT, START_S)
        connection = await operator.connect(site.account["robotId"])
        for label in PLUGIN:
            connection.receivable(label).subscribe(lambda data, label=label: came(label, data))
        await asyncio.sleep(max(0.0, warm_until_s - time.monotonic()))
        begin_s = time.monotonic()
        while (now_s := time.monotonic()) < begin_s + seconds:
            found.rss_mb.append(rss_mb(site.robot.pid))
            await asyncio.sleep(1 - (now_s - begin_s) % 1)
        found.seconds = time.monotonic() - begin_s
    return found


def table(found: Found, rate_mbps: float) -> Table:
    ages = sorted(found.ages_s)
    shown = Table(title=f"{found.seconds / 60:.1f} minutes of 63 Mbit/s into {rate_mbps:g} Mbit/s")
    for name in (
        "Mbit/s arrived",
        "age of the newest value, ms p50 / p95 / p99 / max",
        "robot's memory, MB first / last",
    ):
        shown.add_column(name)
    third = max(1, len(found.rss_mb) // 10)
    first, last = statistics.median(found.rss_mb[:third]), statistics.median(found.rss_mb[-third:])
    ranks = [1000 * ages[min(len(ages) - 1, round(share * len(ages)))] for share in (0.5, 0.95, 0.99, 1.0)]
    shown.add_row(
        f"{found.arrived_bytes * 8 / found.seconds / 1e6:.1f}",
        " / ".join(f"{rank:.0f}" for rank in ranks),
        f"{first:.1f} / {last:.1f}",
    )
    return shown


async def main(arguments: argparse.Namespace) -> None:
    router = LinkProfile("router", delay_ms=10, rate_mbps=arguments.rate, queue_ms=500)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        path = stack.enter_context(ImpairedPath(router))
        site = started_site(Path(folder), stack)
        Console().print(table(await outrun(site, path, arguments.minutes * 60), arguments.rate))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=10.0, help="of the link, Mbit/s (10)")
    run_event_loop(main(parser.parse_args()))
