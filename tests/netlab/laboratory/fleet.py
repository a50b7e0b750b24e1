"""A server in the public network that issues TURN credentials, and a robot behind its NAT."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from laboratory.nats import ROBOT_WAN, NatLab
from laboratory.processes import MOSAIC, started
from laboratory.turn_server import DEAD, SECRET, TURN_IP, URLS, Coturn
from support.processes import QUICK_MOSAIC, mosaic_here

from mosaic_core.operator import MosaicOperator
from mosaic_core.words.ice import IceTransportPolicy

SERVER_PORT = 9001
CONNECTORS = """\
  - { type: test-pattern, label: front, params: { width: 640, height: 480, fps: 30 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
"""


@dataclass(frozen=True)
class Attempt:
    """From the wish to the first value and, where asked for, the first picture."""

    data_s: float
    frame_s: float | None
    issued: list[str]
    """The usernames that the operator was issued."""


@dataclass
class Fleet:
    lab: NatLab
    account: dict[str, str]
    robot_log: Path
    url: str = field(default=f"http://{TURN_IP}:{SERVER_PORT}")

    async def signed_in(self, policy: IceTransportPolicy = "all") -> MosaicOperator:
        operator = await MosaicOperator.login(self.url, self.account["email"], self.account["password"])
        operator.ice_transport_policy = policy
        return operator

    async def attempt(self, operator: MosaicOperator, *, with_picture: bool = False) -> Attempt:
        """One connection, closed again."""
        start_s = time.monotonic()
        connection = await operator.connect(self.account["robotId"], timeout_s=30)
        await connection.receivable("pose").next_message()
        data_s, frame_s = time.monotonic() - start_s, None
        if with_picture:
            await connection.media("front").next_frame()
            frame_s = time.monotonic() - start_s
        issued = [one.username or "" for one in await operator.rest.ice_servers()]
        await connection.close()
        return Attempt(data_s, frame_s, issued)


def run_fleet(
    lab: NatLab,
    coturn: Coturn,
    folder: Path,
    stack: ExitStack,
    wait_for: Callable[..., Any],
    *,
    urls: tuple[str, ...] = (DEAD, *URLS.values()),
    mosaic_server: Sequence[str] = QUICK_MOSAIC,
) -> Fleet:
    """Until the stack closes. ``mosaic_server`` runs instead of ``mosaic`` where the server is."""
    data = ["--data-dir", str(folder)]
    account = json.loads(mosaic_here("server", "seed", *data, "--robot-name", "Lab robot", "--json"))
    (folder / "secret").write_text(SECRET)
    secret = ["--secret-file", str(folder / "secret")] if any(url.startswith("turn") for url in urls) else []
    mosaic_here("server", "ice", "add", *urls, *secret, *data)
    robot_ip, ready = f"{ROBOT_WAN}.1", folder / "ready.json"
    words = ["server", "run", "--host", "0.0.0.0", "--port", str(SERVER_PORT), "--insecure-public", *data]  # noqa: S104
    more = ["--allow-host", robot_ip, "--allow-host", TURN_IP, "--ready-file", str(ready)]
    server_words = [*lab.prefix("public"), *mosaic_server, *words, *more]
    server = started(stack, server_words, folder / "server.log")
    wait_for(lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=server, log=[])
    config, log = folder / "mosaic_config.yaml", folder / "robot.log"
    config.write_text(f"""\
version: 1
server:
  ws_url: ws://{robot_ip}:{SERVER_PORT}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
{CONNECTORS}""")
    robot_words = [*lab.prefix("robot"), *MOSAIC, "run", str(config), "--json"]
    robot = started(stack, robot_words, log, SSL_CERT_FILE=str(coturn.certificate))
    is_ready = re.compile(r'"state": ?"ready"')
    wait_for(lambda: is_ready.search(log.read_text()) is not None, "the robot is ready", alive=robot, log=[])
    return Fleet(lab, account, log)
