"""A robot and operators whose networks change under them: another address, another cable, a server that restarts."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from laboratory.forwarding import ROUTER_OPERATOR_IP, ROUTER_ROBOT_IP, Lab
from laboratory.networks import Namespace, ip
from laboratory.processes import MOSAIC, Process
from laboratory.site import TWIST, Track
from support.processes import QUICK_MOSAIC, mosaic_here

from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.testing import until
from mosaic_core.testing.distributions import write_distribution

Side = Literal["robot", "operator"]
ROBOT_SIDE = Path(__file__).parent.parent / "robot_side"
START_S = 60.0
SILENCE_S = 0.25
"""Control or data that pauses for this long was interrupted: both come 20 times a second."""
SIDES: dict[Side, tuple[str, str]] = {"robot": ("10.77.1", "10.78.1"), "operator": ("10.77.2", "10.78.2")}
"""Of each side: the network of its first cable and of its second."""


class Cables:
    """Both sides' ways to the router; each side has two, and uses one."""

    def __init__(self, lab: Lab) -> None:
        self._lab = lab
        self._host = dict.fromkeys(SIDES, 2)
        self._cable = dict.fromkeys(SIDES, 0)
        for side, networks in SIDES.items():
            router, namespace = lab.router.name, self._namespace(side).name
            ip("-n", router, "link", "add", f"{side}2", "type", "veth", "peer", "name", "eth1", "netns", namespace)
            ip("-n", router, "addr", "add", f"{networks[1]}.1/24", "dev", f"{side}2")
            ip("-n", router, "link", "set", f"{side}2", "up")

    def _namespace(self, side: Side) -> Namespace:
        return self._lab.robot if side == "robot" else self._lab.operator

    def move(self, side: Side) -> float:
        """Another address on the same cable; when, on this machine's clock."""
        name, network, device = self._namespace(side).name, SIDES[side][self._cable[side]], f"eth{self._cable[side]}"
        old, self._host[side] = self._host[side], 2 + (self._host[side] + 1) % 200
        at_s = time.monotonic()
        ip("-n", name, "addr", "del", f"{network}.{old}/24", "dev", device)
        ip("-n", name, "addr", "add", f"{network}.{self._host[side]}/24", "dev", device)
        ip("-n", name, "route", "replace", "default", "via", f"{network}.1", "dev", device)
        return at_s

    def switch(self, side: Side) -> float:
        """The other cable is the way from now on, and the first is pulled: from Wi-Fi to the mobile network."""
        name = self._namespace(side).name
        old, self._cable[side] = self._cable[side], 1 - self._cable[side]
        network, device = SIDES[side][self._cable[side]], f"eth{self._cable[side]}"
        at_s = time.monotonic()
        ip("-n", name, "link", "set", f"eth{old}", "down")
        ip("-n", name, "addr", "flush", "dev", f"eth{old}")
        self._host[side] += 1
        ip("-n", name, "link", "set", device, "up")
        ip("-n", name, "addr", "add", f"{network}.{self._host[side]}/24", "dev", device)
        ip("-n", name, "route", "replace", "default", "via", f"{network}.1", "dev", device)
        return at_s


@dataclass
class RoamingSite:
    """The server, the robot and their cables. ``track``: what the base was told; ``notes``: what arrived reliably."""

    lab: Lab
    cables: Cables
    account: dict[str, str]
    url: str
    track: Track
    notes: Path
    robot: Process
    server: Process
    start_server: Callable[[], None]

    async def token(self) -> str:
        async with await MosaicOperator.login(self.url, self.account["email"], self.account["password"]) as signed_in:
            return signed_in.access_token

    def robot_is_at_the_server(self) -> bool:
        """As it said within the last second."""
        said = [line for line in self.robot.log if line.startswith("{")]
        return bool(said) and json.loads(said[-1])["state"] == "ready"

    def noted(self) -> list[int]:
        whole, _, _ = self.notes.read_text().rpartition("\n")
        return [int(line) for line in whole.splitlines()]


def roaming_site(lab: Lab, folder: Path, stack: ExitStack, wait_for: Callable[..., Any]) -> RoamingSite:
    """Started; ends with ``stack``."""
    words = ["server", "seed", "--data-dir", str(folder), "--robot-name", "Roamer", "--json"]
    account, port = json.loads(mosaic_here(*words)), _free_port(lab.router)
    ready, record, notes = folder / "ready.json", folder / "record.txt", folder / "notes.txt"
    record.touch()
    notes.touch()
    words = ["server", "run", "--host", "0.0.0.0", "--port", str(port), "--insecure-public", "--data-dir", str(folder)]  # noqa: S104
    hosts = [word for address in (ROUTER_ROBOT_IP, ROUTER_OPERATOR_IP) for word in ("--allow-host", address)]
    server = Process([*lab.router.prefix, *QUICK_MOSAIC, *words, *hosts, "--ready-file", str(ready)])
    stack.callback(server.stop)

    def start_server() -> None:
        ready.unlink(missing_ok=True)
        server.start()
        wait_for(lambda: ready.exists() and bool(ready.read_text()), "the server listens", START_S)

    start_server()
    robot = _robot(lab, folder, account, port, record, notes)
    stack.callback(robot.stop)
    robot.start()
    wait_for(lambda: any('"state": "ready"' in line for line in robot.log), "the robot is ready", START_S)
    url = f"http://{ROUTER_OPERATOR_IP}:{port}"
    return RoamingSite(lab, Cables(lab), account, url, Track(record), notes, robot, server, start_server)


def _robot(lab: Lab, folder: Path, account: dict[str, str], port: int, record: Path, notes: Path) -> Process:
    write_distribution(
        folder,
        "roaming-plugin",
        entry_points={
            "mosaic.connectors": {
                "counter": "roaming_connectors:CounterConfigurer",
                "notebook": "roaming_connectors:NotebookConfigurer",
            }
        },
    )
    config = folder / "mosaic_config.yaml"
    config.write_text(f"""\
version: 1
server:
  ws_url: ws://{ROUTER_ROBOT_IP}:{port}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
  - type: cmd-vel
    label: cmd_vel
    params: {{ drive: {{ type: callback, function: "drive_recorder:record_base" }} }}
    safety: {{ timeout_s: 0.3 }}
  - {{ type: counter, label: counter }}
  - {{ type: notebook, label: notebook, params: {{ file: {notes} }} }}
""")
    path = os.pathsep.join(filter(None, (str(folder), str(ROBOT_SIDE), os.environ.get("PYTHONPATH"))))
    return Process(
        [*lab.robot.prefix, *MOSAIC, "run", str(config), "--json"],
        {"PYTHONPATH": path, "DRIVE_RECORD": str(record)},
    )


def _free_port(namespace: Namespace) -> int:
    def found() -> int:
        with socket.socket() as probe:
            probe.bind(("", 0))
            return int(probe.getsockname()[1])

    return namespace.run(found)


@dataclass
class Roamer:
    """An operator who drives, reads and writes all the time. ``numbers``: what the robot counted, in order of arrival;
    ``at_s``: when; ``gaps``: what was told to be lost."""

    site: RoamingSite
    connection: RobotConnection
    numbers: list[int] = field(default_factory=list)
    at_s: list[float] = field(default_factory=list)
    gaps: list[Any] = field(default_factory=list)
    written: list[int] = field(default_factory=list)

    async def begin(self) -> None:
        counter = self.connection.receivable("counter")
        counter.subscribe(self._counted)
        counter.on_gap(self.gaps.append)
        notebook = self.connection.sendable("notebook")
        notebook.on_gap(self.gaps.append)
        await counter.wait_open()
        await notebook.wait_open()
        await self.connection.control.take()
        self._tasks = [asyncio.create_task(work) for work in (self._drive(), self._write(notebook))]
        start_s = time.monotonic()
        await until(lambda: len(self.site.track.moves(start_s)) > 3 and len(self.numbers) > 3, "control and data")

    async def end(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _counted(self, data: bytes) -> None:
        self.numbers.append(json.loads(data)["n"])
        self.at_s.append(time.monotonic())

    async def _drive(self) -> None:
        pad = self.connection.sendable("cmd_vel")
        while True:
            pad.send_json(TWIST)
            await asyncio.sleep(0.05)

    async def _write(self, notebook: Any) -> None:
        number = 0
        while True:
            if notebook.send_json({"n": number}):
                self.written.append(number)
                number += 1
            await asyncio.sleep(0.05)

    async def back_after(self, since_s: float, timeout_s: float = 60.0) -> tuple[float, float]:
        """Seconds from ``since_s`` until data came and commands acted again, after an interruption of both."""
        await until(lambda: self._data_back_s(since_s) is not None, "data is back", timeout_s)
        await until(lambda: self._control_back_s(since_s) is not None, "control is back", timeout_s)
        data_s, control_s = self._data_back_s(since_s), self._control_back_s(since_s)
        assert data_s is not None
        assert control_s is not None
        return data_s - since_s, control_s - since_s

    def _data_back_s(self, since_s: float) -> float | None:
        return _first_after_silence(self.at_s, since_s)

    def _control_back_s(self, since_s: float) -> float | None:
        return _first_after_silence(self.site.track.moves(since_s - 1.0), since_s)


def _first_after_silence(times_s: list[float], since_s: float) -> float | None:
    before_s = max([at_s for at_s in times_s if at_s <= since_s], default=since_s)
    for at_s in times_s:
        if at_s > since_s:
            if at_s - before_s > SILENCE_S:
                return at_s
            before_s = at_s
    return None
