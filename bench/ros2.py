"""What it costs to show a node of ROS 2 to an operator: 640×480 pictures at 30/s and clouds of 100 000 points at 10/s
over DDS, by MOSAIC and by a bridge in the manner of rosbridge (JSON with base64 over a WebSocket, written here).

python bench/ros2.py [SECONDS] [ROUNDS]

Node, bridge or robot, and the operator are processes of their own on loopback, in turns. Age: from the node's clock to
the bytes in the operator's hands, pictures decoded and clouds as arrays. Both readers are Python. MB/s: of messages;
MOSAIC's pictures are no messages and take what `max_bitrate_bps` allows, 1.3 Mbit/s here.
"""

from __future__ import annotations

import asyncio
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import psutil
from processes.mosaic import Site, listening_port, run_mosaic, running, token_once_ready
from processes.other_end import other_end
from ros2_bench.json_bridge import bridge, read_message
from ros2_bench.node import publish
from websockets.asyncio.client import connect

from mosaic_camera.marks import read_marks
from mosaic_core.operator import MosaicOperator
from mosaic_sensors.point_cloud import decoded

SETTLE_S = 3.0
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
  - {{ type: ros2-image, label: front, params: {{ topic: /image, domain: {domain}, interface: lo }} }}
  - {{ type: ros2-point-cloud, label: cloud, params: {{ topic: /points, domain: {domain}, interface: lo }} }}
"""


@dataclass
class Seen:
    """What arrived while it was measured."""

    name: str
    ages_ms: dict[str, list[float]] = field(default_factory=lambda: {"image": [], "cloud": []})
    sent: dict[str, int] = field(default_factory=dict)
    mbyteps: float = 0.0
    sender_cpu: float = 0.0
    reader_cpu: float = 0.0

    def row(self) -> str:
        cells = [self.name]
        for kind in ("image", "cloud"):
            ages = sorted(self.ages_ms[kind])
            lost = 100 * (1 - len(ages) / max(1, self.sent[kind]))
            middle, late = (statistics.median(ages), ages[int(len(ages) * 0.95)]) if ages else (float("nan"),) * 2
            cells += [f"{middle:.0f} / {late:.0f}", f"{max(0.0, lost):.0f} %"]
        return (
            "| "
            + " | ".join([*cells, f"{self.mbyteps:.1f}", f"{self.sender_cpu:.0f} %", f"{self.reader_cpu:.0f} %"])
            + " |"
        )


@contextmanager
def measured(seen: Seen, node: Any, pid: int) -> Iterator[None]:
    """Processor time of the sender and of this process, and what the node sent meanwhile."""

    def used_s(of: int) -> float:
        times = psutil.Process(of).cpu_times()
        return float(times.user + times.system)

    def sent() -> tuple[int, int]:
        node.send("count")
        found: tuple[int, int] = node.recv()
        return found

    before, sender_s, reader_s = sent(), used_s(pid), used_s(os.getpid())
    began_s = time.monotonic()
    yield
    took_s = time.monotonic() - began_s
    after = sent()
    seen.sent = {"image": after[0] - before[0], "cloud": after[1] - before[1]}
    seen.sender_cpu = 100 * (used_s(pid) - sender_s) / took_s
    seen.mbyteps /= took_s * 1e6
    seen.reader_cpu = 100 * (used_s(os.getpid()) - reader_s) / took_s


async def by_mosaic(node: Any, domain: int, seconds: float) -> Seen:
    seen = Seen("MOSAIC")
    with ExitStack() as stack, tempfile.TemporaryDirectory() as name:
        site, robot = _site(Path(name), stack, domain)
        await token_once_ready(site)
        async with await MosaicOperator.login(site.url, site.email, site.password) as operator:
            connection = await operator.connect(site.robot_id)
            is_on = [False]
            tasks = [
                asyncio.create_task(_pictures(connection, seen, is_on)),
                asyncio.create_task(_clouds(connection, seen, is_on)),
            ]
            await asyncio.sleep(SETTLE_S)
            with measured(seen, node, robot):
                is_on[0] = True
                await asyncio.sleep(seconds)
                is_on[0] = False
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await connection.close()
    return seen


def _site(folder: Path, stack: ExitStack, domain: int) -> tuple[Site, int]:
    """A server and a robot; the robot's process id."""
    data_dir, ready_file, log = folder / "server", folder / "ready.json", folder / "server.log"
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    port = listening_port(ready_file, stack.enter_context(running(log, *words)), log)
    config, robot_log = folder / "mosaic_config.yaml", folder / "robot.log"
    told = {"robot_id": seeded["robotId"], "token": seeded["robotToken"]}
    config.write_text(CONFIG.format(port=port, domain=domain, **told))
    robot = stack.enter_context(running(robot_log, "run", str(config), "--json"))
    url = f"http://127.0.0.1:{port}"
    return Site(url, data_dir, robot_log, seeded["email"], seeded["password"], seeded["robotId"]), robot.pid


async def _pictures(connection: Any, seen: Seen, is_on: list[bool]) -> None:
    async for frame in connection.media("front").frames():
        marks = read_marks(frame.to_ndarray(format="gray"))
        if is_on[0] and marks is not None:
            seen.ages_ms["image"].append(1000 * (time.monotonic() - marks.captured_at_s))


async def _clouds(connection: Any, seen: Seen, is_on: list[bool]) -> None:
    store = connection.receivable("cloud")
    while True:
        message = await store.next_message(60.0)
        cloud = decoded(message.data)
        if is_on[0] and cloud.captured_at_s is not None:
            seen.mbyteps += len(message.data)
            seen.ages_ms["cloud"].append(1000 * (time.monotonic() - cloud.captured_at_s))


async def by_json(node: Any, domain: int, seconds: float) -> Seen:
    seen = Seen("JSON and base64 over a WebSocket")
    with other_end(partial(bridge, domain=domain)) as pipe:
        port, pid = await asyncio.to_thread(pipe.recv)
        async with connect(f"ws://127.0.0.1:{port}", max_size=None, compression=None) as socket:
            began_s = time.monotonic()
            while time.monotonic() < began_s + SETTLE_S:
                await socket.recv()
            with measured(seen, node, pid):
                until_s = time.monotonic() + seconds
                while time.monotonic() < until_s:
                    text = str(await socket.recv())
                    topic, stamp_s, _ = read_message(text)
                    seen.mbyteps += len(text)
                    kind = "image" if topic == "/image" else "cloud"
                    seen.ages_ms[kind].append(1000 * (time.monotonic() - stamp_s))
    return seen


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    domain = 1 + os.getpid() % 200
    print(f"load before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    ages = "picture age ms, median / p95 | lost | cloud age ms, median / p95 | lost"
    print(f"| way | {ages} | MB/s | sender CPU | reader CPU |")
    print("|---|---|---|---|---|---|---|---|")
    with other_end(partial(publish, domain=domain)) as node:
        for _ in range(rounds):
            for way in (by_mosaic, by_json):
                print(asyncio.run(way(node, domain, seconds)).row(), flush=True)
    print(f"load after: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
