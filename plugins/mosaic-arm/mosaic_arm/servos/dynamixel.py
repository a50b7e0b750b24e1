"""Dynamixel's protocol 2 and the registers of the X series.

``FF FF FD 00 id length×2 instruction params… crc×2``; a reply has the instruction 55 and then an error byte. Where the
header would appear inside, a further FD is stuffed in behind it. Numbers are little-endian, two's complement.
"""

from __future__ import annotations

from mosaic_arm.servos.bus import MotorReading
from mosaic_arm.servos.packets import ServoReply
from mosaic_arm.servos.registers import Register, ServoRegisters

_HEADER = b"\xff\xff\xfd\x00"
_INSIDE, _STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
_STATUS = 0x55
_LONGEST = 128
_ALERT = 0x80
_TICKS_PER_S = 0.229 * 4096 / 60
"""The unit of the present velocity is 0.229 turns a minute."""
_FAULTS = {0x01: "voltage", 0x04: "overheating", 0x08: "encoder", 0x10: "electric shock", 0x20: "overload"}


def _crc_of(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ 0x8005 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


_CRCS = tuple(map(_crc_of, range(256)))


def crc16(data: bytes) -> int:
    """CRC-16 with the polynomial 8005, beginning at 0."""
    crc = 0
    for byte in data:
        crc = (crc << 8) & 0xFFFF ^ _CRCS[(crc >> 8) ^ byte]
    return crc


class DynamixelFormat:
    """Spells and reads packets of protocol 2, as a ``PacketFormat``."""

    address_size = 2
    overhead = 11

    def instruction(self, motor: int, code: int, params: bytes = b"") -> bytes:
        content = (bytes([code]) + params).replace(_INSIDE, _STUFFED)
        packet = _HEADER + bytes([motor]) + (len(content) + 2).to_bytes(2, "little") + content
        return packet + crc16(packet).to_bytes(2, "little")

    def taken_reply(self, stream: bytearray) -> ServoReply | None:
        while (start := stream.find(_HEADER)) >= 0:
            del stream[:start]
            if len(stream) < 7:
                return None
            size = int.from_bytes(stream[5:7], "little") + 7
            if stream[4] >= 0xFE or not self.overhead <= size <= _LONGEST:
                del stream[0]
                continue
            if len(stream) < size:
                return None
            packet = bytes(stream[:size])
            if crc16(packet[:-2]) != int.from_bytes(packet[-2:], "little"):
                del stream[0]
                continue
            del stream[:size]
            if packet[7] == _STATUS:  # else it is an instruction: an adapter that repeats what we say
                content = packet[8:-2].replace(_STUFFED, _INSIDE)
                return ServoReply(packet[4], content[0], content[1:])
        del stream[: max(0, len(stream) - len(_HEADER) + 1)]
        return None


def reading(reply: ServoReply) -> MotorReading:
    """Registers 126 to 146 of one motor. Its faults stand in another register."""
    data = reply.data

    def number(at: int, size: int) -> int:
        return int.from_bytes(data[at : at + size], "little", signed=True)

    return MotorReading(
        ticks=number(6, 4),
        ticks_per_s=number(2, 4) * _TICKS_PER_S,
        load_percent=number(0, 2) / 10,
        voltage_v=int.from_bytes(data[18:20], "little") / 10,
        temperature_c=data[20],
        faults=("alert",) if reply.error & _ALERT else (),
    )


def faults_of(raw: int) -> tuple[str, ...]:
    """The words for what register 70 holds."""
    return tuple(word for bit, word in _FAULTS.items() if raw & bit)


DYNAMIXEL = ServoRegisters(
    torque=Register(64, 1),
    goal=Register(116, 4),
    torque_limit=Register(100, 2),
    torque_full=885,
    present=Register(126, 21),
    reading=reading,
    offset=Register(20, 4),
    range_min=Register(52, 4),
    range_max=Register(48, 4),
    faults=Register(70, 1),
    faults_of=faults_of,
)
"""Of the X series, such as XL330 and XL430."""
