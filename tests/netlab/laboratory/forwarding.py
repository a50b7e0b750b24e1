"""Robot, router with the server, and operator, in networks of their own.

    robot ── veth ── router (server, forwards) ── veth ── operator

Data between robot and operator is forwarded by the router, which can be told to swallow it, each way by itself; both
still reach the server.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from itertools import count
from pathlib import Path

from laboratory.networks import Namespace, ip

ROBOT_IP, ROUTER_ROBOT_IP = "10.77.1.2", "10.77.1.1"
OPERATOR_IP, ROUTER_OPERATOR_IP = "10.77.2.2", "10.77.2.1"
"""Inside the namespaces only: two runs at the same time don't see each other."""
_numbers = count()


class Lab:
    """The three networks and the two cables between them."""

    def __init__(self, stack: ExitStack) -> None:
        run = f"mosaic-{os.getpid()}-{next(_numbers)}"
        self.robot, self.router, self.operator = (Namespace(f"{run}-{who}") for who in ("robot", "router", "operator"))
        for namespace in (self.robot, self.router, self.operator):
            ip("netns", "add", namespace.name)
            stack.callback(ip, "netns", "del", namespace.name)
            ip("-n", namespace.name, "link", "set", "lo", "up")
        self._connect(self.robot, "robot", ROBOT_IP, ROUTER_ROBOT_IP)
        self._connect(self.operator, "operator", OPERATOR_IP, ROUTER_OPERATOR_IP)
        self.router.run(lambda: Path("/proc/sys/net/ipv4/ip_forward").write_text("1"))
        self._cut: list[str] = []

    def _connect(self, namespace: Namespace, port: str, address: str, router_address: str) -> None:
        router = self.router.name
        ip("-n", router, "link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", namespace.name)
        ip("-n", router, "addr", "add", f"{router_address}/24", "dev", port)
        ip("-n", router, "link", "set", port, "up")
        ip("-n", namespace.name, "addr", "add", f"{address}/24", "dev", "eth0")
        ip("-n", namespace.name, "link", "set", "eth0", "up")
        ip("-n", namespace.name, "route", "add", "default", "via", router_address)

    def cut(self, *, to_robot: bool = True, to_operator: bool = True) -> None:
        """From now on the router swallows what it should forward; nobody is told, as on a bad radio link.

        The server is cut off too from the side whose packets vanish.
        """
        for address, is_cut in ((ROBOT_IP, to_robot), (OPERATOR_IP, to_operator)):
            if is_cut:
                ip("-n", self.router.name, "route", "add", "blackhole", f"{address}/32")
                self._cut.append(address)

    def heal(self) -> None:
        while self._cut:
            ip("-n", self.router.name, "route", "del", "blackhole", f"{self._cut.pop()}/32")
