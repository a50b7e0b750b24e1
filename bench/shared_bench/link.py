"""A robot and an operator in networks of their own, and between them a token bucket: a link as an uplink is one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "tests" / "netlab"))

from laboratory.networks import Namespace, ip

ROBOT_IP, OPERATOR_IP = "10.88.0.1", "10.88.0.2"
DEVICE = "eth0"
BURST_BYTES = 3200
"""Of the bucket: two packets. A larger one would hide what a sender does within a picture."""


@dataclass(frozen=True)
class SharedLink:
    """From ``robot`` to ``operator`` through the bucket; back without one."""

    robot: Namespace
    operator: Namespace

    def sent_bytes(self) -> int:
        """What has left the bucket so far, headers included."""
        words = [*self.robot.prefix, "tc", "-s", "-j", "qdisc", "show", "dev", DEVICE]
        found = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
        return int(found[0]["bytes"])


@contextmanager
def shared_link(rate_mbps: float, queue_ms: float) -> Iterator[SharedLink]:
    """Needs root."""
    link = SharedLink(*(Namespace(f"mosaic-{side}-{os.getpid()}") for side in ("robot", "operator")))
    sides = ((link.robot, ROBOT_IP), (link.operator, OPERATOR_IP))
    for namespace, _ in sides:
        ip("netns", "add", namespace.name)
    try:
        peer = ["peer", "name", DEVICE, "netns", link.operator.name]
        ip("-n", link.robot.name, "link", "add", DEVICE, "type", "veth", *peer)
        for namespace, address in sides:
            ip("-n", namespace.name, "addr", "add", f"{address}/24", "dev", DEVICE)
            for device in ("lo", DEVICE):
                ip("-n", namespace.name, "link", "set", device, "up")
        for namespace, _ in sides:  # without one, a browser offers no address
            ip("-n", namespace.name, "route", "add", "default", "dev", DEVICE)
        bucket = ["tbf", "rate", f"{rate_mbps}mbit", "burst", str(BURST_BYTES), "latency", f"{queue_ms}ms"]
        subprocess.run([*link.robot.prefix, "tc", "qdisc", "add", "dev", DEVICE, "root", *bucket], check=True)
        yield link
    finally:
        for namespace, _ in sides:
            ip("netns", "del", namespace.name)
