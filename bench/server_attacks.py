"""What a stranger at one address costs the others: `/healthz` and the relay of candidates during each attack.

python bench/server_attacks.py [SECONDS] [ATTACK …]

The server runs as `mosaic server run` does, with 1 024 file descriptors as most systems give them; the stranger is a
process of its own at 127.0.0.2, without an account. Linux.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
from attack_bench.stranger import ATTACKS
from rich.console import Console
from rich.table import Table
from websockets.asyncio.client import ClientConnection, connect

from mosaic_server.storage.accounts import add_account
from mosaic_server.storage.database import Database
from mosaic_server.storage.robots import RobotAuthType, add_robot, renew_token

EMAIL, PASSWORD = "ada@example.org", "correct horse battery"
SOFT_FILES = 1024
GIVE_UP_S = 20.0
EVERY_S = 0.02


@contextlib.contextmanager
def server(folder: Path) -> Iterator[int]:
    ready = folder / "ready.json"
    command = [sys.executable, "-m", "mosaic_server", "run", "--port", "0", "--data-dir", str(folder / "data")]
    command += ["--ready-file", str(ready), "--log-level", "error"]

    def as_most_systems() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (SOFT_FILES, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))

    process = subprocess.Popen(command, preexec_fn=as_most_systems)
    try:
        while not ready.exists():
            assert process.poll() is None, "the server did not start"
            time.sleep(0.05)
        yield json.loads(ready.read_text())["port"]
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)


def with_robot(folder: Path) -> tuple[str, str]:
    database = Database(folder / "data")
    try:
        database.migrate()
        person = database.work(add_account, EMAIL, PASSWORD, "Ada")
        robot = database.work(add_robot, person.organization_id, "rover", "", RobotAuthType.SIMPLE_TOKEN)
        return robot.id, database.work(renew_token, robot.id)
    finally:
        database.close()


async def said(socket: ClientConnection, kind: str) -> Any:
    while True:
        message = json.loads(await socket.recv())
        if message["type"] == kind:
            return message["data"]


class People:
    """A robot and an operator with a connection, both at 127.0.0.1, and somebody who asks for `/healthz`."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.relay_s: list[float] = []
        self.health_s: list[float] = []

    async def meet(self, robot_id: str, token: str) -> None:
        base = f"ws://127.0.0.1:{self.port}"
        self.robot = await connect(f"{base}/ws/robot", compression=None, ping_interval=None)
        await self.robot.send(json.dumps({"type": "authorize", "data": {"robotId": robot_id, "data": token}}))
        assert await said(self.robot, "authorize.res") == 100
        await self.robot.send(json.dumps({"type": "status.update", "data": {"status": 0}}))
        async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{self.port}/api/v1", timeout=30) as http:
            body = {"username": EMAIL, "password": PASSWORD}
            access = (await http.post("/account/login/access-token", json=body)).json()["resultData"]["accessToken"]
            self.operator = await connect(f"{base}/ws/user", compression=None, ping_interval=None)
            await self.operator.send(json.dumps({"type": "authorize", "data": {"accessToken": access}}))
            assert await said(self.operator, "authorize.res") == 100
            headers = {"Authorization": f"Bearer {access}"}
            made = await http.post("/webrtc/connection", json={"robotIds": [robot_id]}, headers=headers)
        self.connection = made.json()["resultData"]["sessions"][0]["rtcSessionId"]
        offer = {"rtcConnectionId": self.connection, "sdpOffer": "v=0"}
        await self.operator.send(json.dumps({"type": "signaling.send_sdp_offer", "data": offer}))
        await said(self.robot, "signaling.send_sdp_offer")

    async def relay(self) -> None:
        candidate = {"candidate": "candidate:1 1 udp 1 192.0.2.1 9 typ host", "sdpMid": "0", "sdpMLineIndex": 0}
        data = {"rtcConnectionId": self.connection, "iceCandidate": candidate}
        message = json.dumps({"type": "signaling.exchange_ice_candidate", "data": data})
        while True:
            before_s = time.perf_counter()
            try:
                async with asyncio.timeout(GIVE_UP_S):
                    await self.operator.send(message)
                    await said(self.robot, "signaling.exchange_ice_candidate")
            finally:
                self.relay_s.append(time.perf_counter() - before_s)
            await asyncio.sleep(EVERY_S)

    async def ask(self) -> None:
        while True:
            before_s = time.perf_counter()
            is_answered = True  # who is still waiting at the end counts with the time until then
            try:
                is_answered = await self._asked()
            finally:
                self.health_s.append(time.perf_counter() - before_s if is_answered else GIVE_UP_S)
            await asyncio.sleep(EVERY_S)

    async def _asked(self) -> bool:
        with contextlib.suppress(OSError, TimeoutError):
            async with asyncio.timeout(GIVE_UP_S):
                reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
                writer.write(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
                answer = await reader.read()
                writer.close()
                return answer.startswith(b"HTTP/1.1 200")
        return False


async def under(attack: str, robot: tuple[str, str], port: int, for_s: float) -> People:
    people = People(port)
    await people.meet(*robot)
    command = [sys.executable, "-m", "attack_bench.stranger", attack, str(port)]
    stranger = None
    if attack != "nothing":
        stranger = await asyncio.create_subprocess_exec(*command, cwd=Path(__file__).parent)
    await asyncio.sleep(2.0)
    work = [asyncio.create_task(people.relay()), asyncio.create_task(people.ask())]
    await asyncio.sleep(for_s)
    for task in work:
        task.cancel()
    for outcome in await asyncio.gather(*work, return_exceptions=True):
        if not isinstance(outcome, asyncio.CancelledError):
            print(f"{attack}: {outcome!r}", file=sys.stderr)
    if stranger is not None:
        stranger.kill()
        await stranger.wait()
    for socket in (people.robot, people.operator):
        socket.transport.abort()
    return people


def told(times_s: list[float]) -> list[str]:
    ordered = sorted(times_s)
    shares = (ordered[len(ordered) // 2], ordered[int(len(ordered) * 0.99)], ordered[-1])
    return [f"{1000 * value:.0f}" for value in shares]


def main() -> None:
    for_s = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    table = Table(title=f"Others during an attack from one address, ms, {for_s:.0f} s each")
    for column in ("attack", "relay p50", "p99", "max", "/healthz p50", "p99", "max"):
        table.add_column(column, justify="left" if column == "attack" else "right")
    for attack in sys.argv[2:] or ["nothing", *ATTACKS]:
        with tempfile.TemporaryDirectory() as folder:
            robot = with_robot(Path(folder))
            with server(Path(folder)) as port:
                people = asyncio.run(under(attack, robot, port, for_s))
        table.add_row(attack, *told(people.relay_s), *told(people.health_s))
    Console().print(table)


if __name__ == "__main__":
    main()
