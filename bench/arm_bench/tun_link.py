"""Two networks, each of a namespace of its own, and between them a link that delays and loses packets as told.

The kernels of many machines have no netem, so the packets pass through two TUN devices and this process. TCP and UDP
alike. Needs root.
"""

from __future__ import annotations

import fcntl
import heapq
import itertools
import os
import random
import select
import struct
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "tests" / "netlab"))

from laboratory.networks import Namespace, ip

from mosaic_core.machines.laboratory.impaired_link import PROFILES, ImpairedLink

ROBOT_IP, OPERATOR_IP = "10.89.0.1", "10.89.0.2"
DEVICE = "tun0"
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
_numbers = itertools.count()


@dataclass(frozen=True, slots=True)
class TunLink:
    """The two ends."""

    robot: Namespace
    operator: Namespace


@contextmanager
def tun_link(profile: str) -> Iterator[TunLink]:
    """The names are this process's own, so that several runs don't meet."""
    name = f"mosaic-arm-{os.getpid()}-{next(_numbers)}"
    link = TunLink(Namespace(f"{name}-robot"), Namespace(f"{name}-operator"))
    sides = ((link.robot, ROBOT_IP, OPERATOR_IP), (link.operator, OPERATOR_IP, ROBOT_IP))
    made: list[Namespace] = []
    files: list[int] = []
    try:
        for namespace, own, other in sides:
            ip("netns", "add", namespace.name)
            made.append(namespace)
            files.append(namespace.run(_opened_tun))
            ip("-n", namespace.name, "addr", "add", own, "peer", other, "dev", DEVICE)
            for device in ("lo", DEVICE):
                ip("-n", namespace.name, "link", "set", device, "up")
            ip("-n", namespace.name, "route", "add", "default", "dev", DEVICE)
        with _carried(files[0], files[1], profile):
            yield link
    finally:
        for file in files:
            os.close(file)
        for namespace in made:
            ip("netns", "del", namespace.name)


def _opened_tun() -> int:
    file = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(file, _TUNSETIFF, struct.pack("16sH", DEVICE.encode(), _IFF_TUN | _IFF_NO_PI))
    return file


@contextmanager
def _carried(robot: int, operator: int, profile: str) -> Iterator[None]:
    stop_reads, stop_writes = os.pipe()
    thread = threading.Thread(target=_carry, args=(robot, operator, profile, stop_reads), daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.write(stop_writes, b"x")
        thread.join()
        os.close(stop_reads)
        os.close(stop_writes)


def _carry(robot: int, operator: int, profile: str, stop: int) -> None:
    chance, number = random.Random(1), itertools.count()
    links = {file: (other, ImpairedLink(PROFILES[profile])) for file, other in ((robot, operator), (operator, robot))}
    due: list[tuple[float, int, int, bytes]] = []
    while True:
        wait_s = max(0.0, due[0][0] - time.monotonic()) if due else None
        ready, _, _ = select.select([*links, stop], [], [], wait_s)
        if stop in ready:
            return
        for file in ready:
            packet = os.read(file, 65536)
            other, link = links[file]
            arrival_s = link.arrival_s(
                len(packet), time.monotonic(), chance.random(), chance.uniform(-1, 1), chance.random()
            )
            if arrival_s is not None:
                heapq.heappush(due, (arrival_s, next(number), other, packet))
        while due and due[0][0] <= time.monotonic():
            _, _, other, packet = heapq.heappop(due)
            os.write(other, packet)
