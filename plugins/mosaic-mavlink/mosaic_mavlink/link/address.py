"""Reads the ``url`` of a link: the spellings of pymavlink, and ``fake:``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, cast

Transport: TypeAlias = Literal["udpin", "udpout", "tcp", "serial", "fake"]
Source: TypeAlias = tuple[Any, ...] | None
"""Where bytes came from; ``None`` where there is only one other end."""
FAKE_KINDS = ("copter", "px4", "rover")
SPELLINGS = (
    "udpin:0.0.0.0:14550 (listen), udpout:192.168.4.1:14550 (send first), tcp:127.0.0.1:5760, /dev/ttyACM0 or COM3 "
    "(serial), or fake: for a vehicle that is made up"
)
_NETWORK = re.compile(r"^(udpin|udp|udpout|tcp):(\[[0-9a-fA-F:.]+\]|[^:\[\]/\s]+):(\d{1,5})$")
_SERIAL = re.compile(r"^(/dev/[^\s,]+|COM\d{1,3})$")


@dataclass(frozen=True, slots=True)
class LinkAddress:
    """Where a link goes. ``host``: a name or address, a serial port, or the kind of vehicle that is made up."""

    transport: Transport
    host: str
    port: int = 0


def link_address(url: str) -> LinkAddress:
    """The address that ``url`` spells. Raises :class:`ValueError` that says how one is spelt."""
    if found := _NETWORK.match(url):
        transport, host, port = found[1], found[2].strip("[]"), int(found[3])
        if 0 < port <= 0xFFFF:
            return LinkAddress("udpin" if transport == "udp" else cast(Transport, transport), host, port)
    elif _SERIAL.match(url):
        return LinkAddress("serial", url)
    elif url.startswith("fake:") and (url[5:] or FAKE_KINDS[0]) in FAKE_KINDS:
        return LinkAddress("fake", url[5:] or FAKE_KINDS[0])
    raise ValueError(f"{url!r} is no link; write {SPELLINGS}")
