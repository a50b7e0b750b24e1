"""The two ways from a leader to a follower: ``mosaic arm follow`` to a robot of ours, and a hand-made WebSocket."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from processes.mosaic import MOSAIC, START_S, listening_port, run_mosaic

from arm_bench.chains import Chains
from arm_bench.hand_made import FASTEST_RADPS, JOINT

CONFIG = """\
version: 1
server:
  ws_url: ws://{ip}:{port}
  auth: {{ type: simple-token, robot_id: "{robotId}", params: {{ token: "{robotToken}" }} }}
connectors:
  - type: arm-joints
    label: joints
    params: {{ arm: &arm {{ port: {bus}, gripper: null, joints: {{ {joint}: {{ id: 1, max_radps: {radps} }} }} }} }}
  - {{ type: arm-state, label: joint_state, params: {{ arm: *arm }} }}
"""
HAND_MADE = Path(__file__).with_name("hand_made.py")
HAND_MADE_PORT = 8765


@dataclass(frozen=True, slots=True)
class Network:
    """Where the two sides run: the first words of their command lines, and the robot's address for the operator."""

    robot_prefix: Sequence[str] = ()
    operator_prefix: Sequence[str] = ()
    robot_ip: str = "127.0.0.1"


Way = Callable[[Network, Chains, Path, ExitStack], None]
"""Starts both sides; returns when the follower follows."""


def ours(network: Network, chains: Chains, folder: Path, stack: ExitStack) -> None:
    data, ready = ["--data-dir", str(folder / "server")], folder / "ready.json"
    account = json.loads(run_mosaic("server", "seed", *data, "--json"))
    words = ["server", "run", *data, "--host", "0.0.0.0", "--port", "0", "--insecure-public"]  # noqa: S104
    words += ["--allow-host", network.robot_ip, "--ready-file", str(ready)]
    log = folder / "server.log"
    server = stack.enter_context(started([*network.robot_prefix, *MOSAIC, *words], log))
    port = listening_port(ready, server, log)
    config = folder / "mosaic_config.yaml"
    config.write_text(
        CONFIG.format(
            ip=network.robot_ip, port=port, bus=chains.follower.port, joint=JOINT, radps=FASTEST_RADPS, **account
        ),
        "utf-8",
    )
    robot_log, follow_log = folder / "robot.log", folder / "follow.log"
    robot = stack.enter_context(started([*network.robot_prefix, *MOSAIC, "run", str(config), "--json"], robot_log))
    wait_in(robot_log, '"state": "ready"', robot)
    follow = [
        "arm",
        "follow",
        account["robotId"],
        "joints",
        "--leader-port",
        chains.leader.port,
        "--joint",
        f"{JOINT}=1",
    ]
    follow += ["--approach-radps", "2", "--json"]
    signed_in = {
        "MOSAIC_SERVER": f"http://{network.robot_ip}:{port}", "MOSAIC_EMAIL": account["email"],
        "MOSAIC_PASSWORD": account["password"],
    }  # fmt: skip
    following = stack.enter_context(started([*network.operator_prefix, *MOSAIC, *follow], follow_log, **signed_in))
    wait_in(follow_log, '"phase": "following"', following)


def hand_made(network: Network, chains: Chains, folder: Path, stack: ExitStack) -> None:
    python = [sys.executable, str(HAND_MADE)]
    place = f"{network.robot_ip}:{HAND_MADE_PORT}"
    sides = (
        ("robot", [*network.robot_prefix, *python, "robot", chains.follower.port, place]),
        ("operator", [*network.operator_prefix, *python, "operator", chains.leader.port, f"ws://{place}"]),
    )
    for side, words in sides:
        log = folder / f"{side}.log"
        wait_in(log, "ready", stack.enter_context(started(words, log)))


@contextmanager
def started(words: Sequence[str], log: Path, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run until the end of the block; what it writes goes to ``log``."""
    with log.open("wb") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT, env={**os.environ, **environment})
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_in(log: Path, sign: str, process: subprocess.Popen[bytes]) -> None:
    """Until ``sign`` stands in a log."""
    ends_at_s = time.monotonic() + START_S
    while sign not in log.read_text(errors="replace"):
        if process.poll() is not None or time.monotonic() > ends_at_s:
            raise SystemExit(f"{log.name} never had {sign!r}:\n{log.read_text(errors='replace')[-3000:]}")
        time.sleep(0.02)
