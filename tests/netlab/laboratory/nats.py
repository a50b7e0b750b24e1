"""Robot and operator behind a NAT each, with a public network between them.

robot ── NAT ── public network (server, coturn) ── NAT ── operator
"""

from __future__ import annotations

import asyncio
import os
import subprocess
from collections.abc import Callable
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any, Literal

from laboratory.networks import Namespace

ROBOT_WAN, OPERATOR_WAN = "198.51.100", "203.0.113"  # TEST-NET-2 and -3 (RFC 5737) play the public network
ROBOT_LAN, OPERATOR_LAN = "192.168.1", "192.168.2"
NAMES = ("robot", "robot-nat", "public", "operator-nat", "operator")
Kind = Literal["endpoint-independent", "symmetric"]
MASQUERADE: dict[Kind, str] = {"endpoint-independent": "masquerade", "symmetric": "masquerade fully-random"}
"""The first keeps the inner port where nobody else has it, towards all destinations; who was not spoken to is filtered.
The second takes another port for every destination."""
NAT_RULES = """\
table ip lab {
  chain masked { type nat hook postrouting priority 100; oifname "wan" MASQUERADE; }
  chain forwarded {
    type filter hook forward priority 0; policy drop;
    jump forbidden
    iifname "lan" accept
    ct state established,related accept
  }
  chain received {
    type filter hook input priority 0; policy drop;
    iifname != "wan" accept
    ct state established,related accept
  }
  chain forbidden { }
}
"""
"""As home routers do, who was not spoken to is dropped in silence: a packet that is taken in leaves a record, and the
answer to it then gets another port."""
_numbers = count()


def command(*words: str, text: str | None = None) -> str:
    done = subprocess.run(words, capture_output=True, text=True, input=text, timeout=60)
    if done.returncode != 0:
        raise OSError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


class NatLab:
    """The five networks by name. ``kind``: what both NATs are."""

    def __init__(self, stack: ExitStack, kind: Kind = "symmetric") -> None:
        run = f"mosaic-{os.getpid()}-nat{next(_numbers)}"
        self.networks = {name: Namespace(f"{run}-{name}") for name in NAMES}
        for network in self.networks.values():
            command("ip", "netns", "add", network.name)
            stack.callback(command, "ip", "netns", "del", network.name)
            command("ip", "-n", network.name, "link", "set", "lo", "up")
        for who, lan, wan in (("robot", ROBOT_LAN, ROBOT_WAN), ("operator", OPERATOR_LAN, OPERATOR_WAN)):
            self._connect(who, lan, wan, NAT_RULES.replace("MASQUERADE", MASQUERADE[kind]))
        for name in ("robot-nat", "public", "operator-nat"):
            self.networks[name].run(lambda: Path("/proc/sys/net/ipv4/ip_forward").write_text("1"))

    def on_operators_side(self, body: Callable[[], Any]) -> Any:
        return self.networks["operator"].run(lambda: asyncio.run(body()))

    def prefix(self, name: str) -> list[str]:
        return list(self.networks[name].prefix)

    def forbid(self, *matches: str) -> None:
        """Both NATs drop what matches these nft expressions."""
        for who in ("robot-nat", "operator-nat"):
            for match in matches:
                command(*self.prefix(who), "nft", "add", "rule", "ip", "lab", "forbidden", *match.split(), "drop")

    def allow_all(self) -> None:
        """Nothing is forbidden any more."""
        for who in ("robot-nat", "operator-nat"):
            command(*self.prefix(who), "nft", "flush", "chain", "ip", "lab", "forbidden")

    def _connect(self, who: str, lan: str, wan: str, rules: str) -> None:
        inside, nat = self.networks[who], self.networks[f"{who}-nat"]
        _cable(nat, "lan", f"{lan}.1", inside, "eth0", f"{lan}.2")
        _cable(self.networks["public"], who, f"{wan}.1", nat, "wan", f"{wan}.11")
        command("ip", "-n", inside.name, "route", "add", "default", "via", f"{lan}.1")
        command("ip", "-n", nat.name, "route", "add", "default", "via", f"{wan}.1")
        command(*nat.prefix, "nft", "-f", "-", text=rules)


def _cable(one: Namespace, port: str, address: str, other: Namespace, other_port: str, other_address: str) -> None:
    command("ip", "-n", one.name, "link", "add", port, "type", "veth", "peer", "name", other_port, "netns", other.name)
    for network, name, its in ((one, port, address), (other, other_port, other_address)):
        command("ip", "-n", network.name, "addr", "add", f"{its}/24", "dev", name)
        command("ip", "-n", network.name, "link", "set", name, "up")
