"""STUN messages (RFC 8489) with what TURN adds (RFC 8656), without credentials: enough to play a public server."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from ipaddress import IPv4Address
from typing import Literal

from mosaic_core.machines.laboratory.nat import Endpoint

COOKIE = 0x2112A442
HEADER_BYTES = 20
Class = Literal["request", "indication", "success", "error"]
_CLASS_BITS: dict[int, Class] = {0x000: "request", 0x010: "indication", 0x100: "success", 0x110: "error"}
_BITS_OF = {name: bits for bits, name in _CLASS_BITS.items()}
_CLASS_MASK = 0x110

BINDING, ALLOCATE, REFRESH = 0x001, 0x003, 0x004
SEND, DATA, CREATE_PERMISSION, CHANNEL_BIND = 0x006, 0x007, 0x008, 0x009
"""Methods."""
ERROR_CODE, CHANNEL_NUMBER, LIFETIME, XOR_PEER, PAYLOAD = 0x0009, 0x000C, 0x000D, 0x0012, 0x0013
XOR_RELAYED, XOR_MAPPED = 0x0016, 0x0020
"""Attributes."""
_IPV4 = 1


@dataclass(frozen=True, slots=True)
class StunMessage:
    """A STUN message as it was read. ``attributes``: the first of each number, as bytes."""

    method: int
    kind: Class
    transaction: bytes
    attributes: Mapping[int, bytes] = field(default_factory=dict)

    def answer(self, attributes: Mapping[int, bytes]) -> StunMessage:
        return StunMessage(self.method, "success", self.transaction, attributes)

    def refusal(self, code: int, why: str) -> StunMessage:
        value = struct.pack("!HBB", 0, code // 100, code % 100) + why.encode()
        return StunMessage(self.method, "error", self.transaction, {ERROR_CODE: value})

    def encoded(self) -> bytes:
        parts = []
        for number, value in self.attributes.items():
            parts.append(struct.pack("!HH", number, len(value)) + value + bytes(-len(value) % 4))
        body = b"".join(parts)
        return struct.pack("!HHI", self.method | _BITS_OF[self.kind], len(body), COOKIE) + self.transaction + body


def parse_stun(data: bytes) -> StunMessage | None:
    """``None`` for what is no STUN message."""
    if len(data) < HEADER_BYTES or data[0] & 0xC0:
        return None
    kind, length, cookie = struct.unpack_from("!HHI", data)
    if cookie != COOKIE or len(data) != HEADER_BYTES + length or length % 4:
        return None
    attributes: dict[int, bytes] = {}
    at = HEADER_BYTES
    while at < len(data):
        number, size = struct.unpack_from("!HH", data, at)
        if at + 4 + size > len(data):
            return None
        attributes.setdefault(number, data[at + 4 : at + 4 + size])
        at += 4 + size + -size % 4
    return StunMessage(kind & ~_CLASS_MASK, _CLASS_BITS[kind & _CLASS_MASK], data[8:HEADER_BYTES], attributes)


def xor_address(endpoint: Endpoint) -> bytes:
    """An IPv4 endpoint as the ``XOR-…`` attributes carry it."""
    host = int(IPv4Address(endpoint[0])) ^ COOKIE
    return struct.pack("!BBHI", 0, _IPV4, endpoint[1] ^ COOKIE >> 16, host)


def parse_xor_address(value: bytes) -> Endpoint | None:
    """``None`` for another family than IPv4."""
    if len(value) != 8 or value[1] != _IPV4:
        return None
    _, _, port, host = struct.unpack("!BBHI", value)
    return str(IPv4Address(host ^ COOKIE)), port ^ COOKIE >> 16
