"""Feetech's protocol of the STS and SMS series: packets and registers.

``FF FF id length instruction params… checksum``; a reply has an error byte where the instruction stands. Numbers are
little-endian, and signed ones are a magnitude and a sign bit.
"""

from __future__ import annotations

from mosaic_arm.servos.bus import MotorReading
from mosaic_arm.servos.packets import ServoReply
from mosaic_arm.servos.registers import Register, ServoRegisters

_HEADER = b"\xff\xff"
_LONGEST = 128
"""Bytes of data and frame of the longest reply that we ask for, with room."""
_FAULTS = {0x01: "voltage", 0x02: "angle sensor", 0x04: "overheating", 0x08: "current", 0x20: "overload"}


def checksum(body: bytes) -> int:
    """Of everything between the header and itself."""
    return ~sum(body) & 0xFF


class FeetechFormat:
    """Spells and reads Feetech's packets, as a ``PacketFormat``."""

    address_size = 1
    overhead = 6

    def instruction(self, motor: int, code: int, params: bytes = b"") -> bytes:
        body = bytes([motor, len(params) + 2, code]) + params
        return _HEADER + body + bytes([checksum(body)])

    def taken_reply(self, stream: bytearray) -> ServoReply | None:
        while (start := stream.find(_HEADER)) >= 0:
            del stream[:start]
            if len(stream) < 4:
                return None
            size = stream[3] + 4
            if stream[2] >= 0xFE or not self.overhead <= size <= _LONGEST:
                del stream[0]  # this was no header: a third FF, or noise
                continue
            if len(stream) < size:
                return None
            body = bytes(stream[2 : size - 1])
            if stream[size - 1] != checksum(body):
                del stream[0]
                continue
            del stream[:size]
            return ServoReply(body[0], body[2], body[3:])
        del stream[: len(stream) - (stream[-1:] == b"\xff")]
        return None


def to_sign_bit(value: int, bit: int) -> int:
    """A signed number as the motor spells it."""
    return value if value >= 0 else -value | 1 << bit


def from_sign_bit(raw: int, bit: int) -> int:
    return -(raw & ~(1 << bit)) if raw & 1 << bit else raw


def reading(reply: ServoReply) -> MotorReading:
    """Registers 56 to 63 of one motor."""

    def number(at: int) -> int:
        return int.from_bytes(reply.data[at : at + 2], "little")

    return MotorReading(
        ticks=from_sign_bit(number(0), 15),
        ticks_per_s=from_sign_bit(number(2), 15),
        load_percent=from_sign_bit(number(4), 10) / 10,
        voltage_v=reply.data[6] / 10,
        temperature_c=reply.data[7],
        faults=tuple(word for bit, word in _FAULTS.items() if reply.error & bit),
    )


FEETECH = ServoRegisters(
    torque=Register(40, 1),
    goal=Register(42, 2, lambda value: to_sign_bit(value, 15)),
    torque_limit=Register(48, 2),
    torque_full=1000,
    present=Register(56, 8),
    reading=reading,
    offset=Register(31, 2, lambda value: to_sign_bit(value, 11), lambda raw: from_sign_bit(raw, 11)),
    range_min=Register(9, 2),
    range_max=Register(11, 2),
    lock=Register(55, 1),
)
"""Of an STS3215 and its relatives."""
