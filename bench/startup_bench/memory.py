"""How much memory a robot's process holds: idle, with an operator, with a camera that is watched."""

from __future__ import annotations

import asyncio
import json
import re
import sys
import tempfile
from asyncio.subprocess import PIPE
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from processes.mosaic import Site, listening_port, run_mosaic, running, token_once_ready

from mosaic_core.operator import MosaicOperator, RobotConnection

SETTLE_S = 3.0
"""What is loaded and reserved on the way up is all there, and what was needed for a moment is given back."""
NO_CAMERA = """\
  - { type: host-load, label: host }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: log } } }
  - { type: connection-check, label: link }
"""
PATTERN = "  - { type: test-pattern, label: front }\n"
CONFIG = """\
server:
  ws_url: ws://127.0.0.1:{port}
  auth: {{ type: simple-token, robot_id: "{robot_id}", params: {{ token: "{token}" }} }}
connectors:
{connectors}"""

Work = Callable[[RobotConnection], Awaitable[object]]


@dataclass(frozen=True, slots=True)
class Resident:
    """A process's memory: all that it holds, and what of it no other process shares."""

    whole_mb: float
    own_mb: float

    @classmethod
    def of(cls, pid: int) -> Resident:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
        kb = {name: int(size) for name, size in re.findall(r"^(\w+):\s+(\d+) kB$", rollup, re.MULTILINE)}
        return cls(kb["Rss"] / 1024, (kb["Private_Clean"] + kb["Private_Dirty"]) / 1024)


async def _hears(connection: RobotConnection) -> None:
    await connection.receivable("host").next_message(10)


async def _watches(connection: RobotConnection) -> None:
    await _hears(connection)
    await connection.media("front").next_frame(10)


ROBOTS: dict[str, tuple[str, Work | None]] = {
    "robot without cameras, idle": (NO_CAMERA, None),
    "robot without cameras, one operator": (NO_CAMERA, _hears),
    "robot with a test pattern, idle": (NO_CAMERA + PATTERN, None),
    "robot with a test pattern, one operator watches": (NO_CAMERA + PATTERN, _watches),
}


def measured() -> Iterator[tuple[str, Resident]]:
    """Plain aiortc first, then our robots one after the other."""
    yield "plain aiortc, one data channel", asyncio.run(_plain())
    for name, (connectors, work) in ROBOTS.items():
        yield name, asyncio.run(_of_robot(connectors, work))


async def _plain() -> Resident:
    from aiortc import RTCPeerConnection, RTCSessionDescription

    script = str(Path(__file__).with_name("plain_robot.py"))
    other = await asyncio.create_subprocess_exec(sys.executable, script, stdin=PIPE, stdout=PIPE)
    assert other.stdin is not None
    assert other.stdout is not None
    peer, opened = RTCPeerConnection(), asyncio.Event()
    peer.createDataChannel("pose").on("open", opened.set)
    await peer.setLocalDescription(await peer.createOffer())
    other.stdin.write(json.dumps(peer.localDescription.sdp).encode() + b"\n")
    answer = json.loads(await other.stdout.readline())
    await peer.setRemoteDescription(RTCSessionDescription(answer, "answer"))
    await opened.wait()
    await asyncio.sleep(SETTLE_S)
    resident = Resident.of(other.pid)
    other.stdin.close()
    await asyncio.gather(other.wait(), peer.close())
    return resident


async def _of_robot(connectors: str, work: Work | None) -> Resident:
    with tempfile.TemporaryDirectory() as folder, _site(Path(folder), connectors) as (site, pid):
        token = await token_once_ready(site)
        async with MosaicOperator(site.url, token) as operator:
            if work is not None:
                await work(await operator.connect(site.robot_id))
            await asyncio.sleep(SETTLE_S)
            return Resident.of(pid)


@contextmanager
def _site(folder: Path, connectors: str) -> Iterator[tuple[Site, int]]:
    """A server and one robot, and the robot's process."""
    data_dir, ready_file = folder / "server", folder / "ready.json"
    seeded = json.loads(run_mosaic("server", "seed", "--data-dir", str(data_dir), "--json"))
    words = ["server", "run", "--data-dir", str(data_dir), "--port", "0", "--ready-file", str(ready_file)]
    with ExitStack() as stack:
        server = stack.enter_context(running(folder / "server.log", *words))
        port = listening_port(ready_file, server, folder / "server.log")
        config, log = folder / "mosaic_config.yaml", folder / "robot.log"
        given = {"port": port, "robot_id": seeded["robotId"], "token": seeded["robotToken"]}
        config.write_text(CONFIG.format(connectors=connectors, **given))
        robot = stack.enter_context(running(log, "run", str(config)))
        url = f"http://127.0.0.1:{port}"
        yield Site(url, data_dir, log, seeded["email"], seeded["password"], seeded["robotId"]), robot.pid
