"""What both protocols of servos have in common: instructions, replies, and finding replies in a stream of bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x82, 0x83
BROADCAST = 0xFE


@dataclass(frozen=True, slots=True)
class ServoReply:
    """What one motor answered. ``error``: the byte in which it tells what is wrong with it."""

    motor: int
    error: int
    data: bytes


class PacketFormat(Protocol):
    """Spells instructions as bytes and reads replies from bytes. Pure."""

    address_size: int
    """Bytes of a register's number, and of a length."""
    overhead: int
    """Bytes of a reply beside its data."""

    def instruction(self, motor: int, code: int, params: bytes = b"") -> bytes:
        """A whole packet."""

    def taken_reply(self, stream: bytearray) -> ServoReply | None:
        """Cut the first whole and correct reply out of ``stream``, with all noise before it; ``None``: there is none
        yet. What is left is bounded by the longest reply."""


def read_block(form: PacketFormat, motors: Sequence[int], address: int, size: int) -> bytes:
    """The packet that asks several motors for the same registers at once."""
    return form.instruction(BROADCAST, SYNC_READ, _number(form, address) + _number(form, size) + bytes(motors))


def read_one(form: PacketFormat, motor: int, address: int, size: int) -> bytes:
    return form.instruction(motor, READ, _number(form, address) + _number(form, size))


def write_one(form: PacketFormat, motor: int, address: int, data: bytes) -> bytes:
    return form.instruction(motor, WRITE, _number(form, address) + data)


def write_block(form: PacketFormat, address: int, data: Mapping[int, bytes]) -> bytes:
    """The packet that writes the same registers of several motors; nobody answers it."""
    size = len(next(iter(data.values())))
    values = b"".join(bytes([motor]) + value for motor, value in data.items())
    return form.instruction(BROADCAST, SYNC_WRITE, _number(form, address) + _number(form, size) + values)


def _number(form: PacketFormat, value: int) -> bytes:
    return value.to_bytes(form.address_size, "little")
