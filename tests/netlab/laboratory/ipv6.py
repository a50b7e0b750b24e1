"""Robot, router with the server, and operator, whose networks know IPv6: alone, or beside IPv4.

robot ── veth ── router (server, forwards) ── veth ── operator
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laboratory.nats import command
from laboratory.networks import Namespace
from laboratory.processes import MOSAIC, started
from support.processes import QUICK_MOSAIC, mosaic_here

V6 = {"robot": "2001:db8:1", "operator": "2001:db8:2"}  # the documentation's prefix (RFC 3849)
V4 = {"robot": "198.51.100", "operator": "203.0.113"}
PORT = 9001


@dataclass
class SixSite:
    """Both can reach the server, and each other, over IPv6."""

    networks: dict[str, Namespace]
    account: dict[str, str]
    url: str = f"http://[{V6['operator']}::1]:{PORT}"


def _connect(router: Namespace, who: Namespace, name: str, *, with_v4: bool) -> None:
    command("ip", "-n", router.name, "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", who.name)
    addresses = [(f"{V6[name]}::1/64", f"{V6[name]}::2/64")]
    if with_v4:
        addresses.append((f"{V4[name]}.1/24", f"{V4[name]}.2/24"))
    for end, port, number in ((router, name, 0), (who, "eth0", 1)):
        command("ip", "-n", end.name, "link", "set", port, "up")
        for both in addresses:
            # Without the wait for somebody else who has the address already.
            nodad = ["nodad"] if ":" in both[number] else []
            command("ip", "-n", end.name, "addr", "add", both[number], "dev", port, *nodad)
    for near, _ in addresses:
        command("ip", "-n", who.name, "route", "add", "default", "via", near.partition("/")[0])


def run_six_site(folder: Path, stack: ExitStack, wait_for: Callable[..., Any], *, with_v4: bool) -> SixSite:
    """Until the stack closes."""
    run = f"mosaic-{os.getpid()}-six{int(with_v4)}"
    networks = {name: Namespace(f"{run}-{name}") for name in ("robot", "router", "operator")}
    for network in networks.values():
        command("ip", "netns", "add", network.name)
        stack.callback(command, "ip", "netns", "del", network.name)
        command("ip", "-n", network.name, "link", "set", "lo", "up")
    router = networks["router"]
    for name in ("robot", "operator"):
        _connect(router, networks[name], name, with_v4=with_v4)
    for file in ("ipv6/conf/all/forwarding", "ipv4/ip_forward"):
        router.run(lambda file=file: Path("/proc/sys/net", file).write_text("1"))  # type: ignore[misc]
    account = _start(networks, folder, stack, wait_for)
    return SixSite(networks, account)


def _start(
    networks: dict[str, Namespace], folder: Path, stack: ExitStack, wait_for: Callable[..., Any]
) -> dict[str, str]:
    data, ready = ["--data-dir", str(folder)], folder / "ready.json"
    account: dict[str, str] = json.loads(mosaic_here("server", "seed", *data, "--robot-name", "Lab robot", "--json"))
    words = ["server", "run", "--host", "::", "--port", str(PORT), "--insecure-public", *data]
    hosts = [word for prefix in V6.values() for word in ("--allow-host", f"{prefix}::1")]
    server = started(
        stack,
        [*networks["router"].prefix, *QUICK_MOSAIC, *words, *hosts, "--ready-file", str(ready)],
        folder / "server.log",
    )
    wait_for(lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=server, log=[])
    config, log = folder / "mosaic_config.yaml", folder / "robot.log"
    config.write_text(f"""\
version: 1
server:
  ws_url: ws://[{V6["robot"]}::1]:{PORT}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
  - {{ type: sim-pose, label: pose, params: {{ period_s: 0.05 }} }}
""")
    robot = started(stack, [*networks["robot"].prefix, *MOSAIC, "run", str(config), "--json"], log)
    is_ready = re.compile(r'"state": ?"ready"')
    wait_for(lambda: is_ready.search(log.read_text()) is not None, "the robot is ready", alive=robot, log=[])
    return account
