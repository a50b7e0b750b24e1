"""Servos that are made up, byte by byte, behind a pseudo terminal: they check what they are sent as real ones do, and
answer, or do not."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

HELLO = 0x01


@dataclass
class FakeServo:
    """The registers of one motor."""

    registers: bytearray = field(default_factory=lambda: bytearray(256))
    error: int = 0

    def put(self, address: int, value: int, size: int) -> None:
        self.registers[address : address + size] = (value % (1 << 8 * size)).to_bytes(size, "little")

    def get(self, address: int, size: int) -> int:
        return int.from_bytes(self.registers[address : address + size], "little")


class ServoChain:
    """A bus of fake motors on a pseudo terminal, served by a thread. ``drops``: so many replies of a motor never come;
    ``breaks``: so many have a wrong checksum; ``noise``: goes out before each reply."""

    address_size = 1
    goal = (42, 2)
    present = (56, 2)

    def __init__(self, motors: list[int]) -> None:
        self.motors = {motor: FakeServo() for motor in motors}
        self.drops: dict[int, int] = {}
        self.breaks: dict[int, int] = {}
        self.noise = b""
        self.complaints: list[str] = []
        self.instructions: list[tuple[int, int, bytes]] = []
        self.follows = True
        self.heard: Callable[[int, int, bytes], object] = lambda motor, code, params: None
        """Called on the chain's thread with each instruction, before it is obeyed."""
        self._ours, theirs = os.openpty()
        tty.setraw(theirs)
        self.port = os.ttyname(theirs)
        self._theirs: int | None = theirs
        self._stop_reads, self._stop_writes = os.pipe()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> ServoChain:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.vanish()
        os.close(self._stop_reads)

    def vanish(self) -> None:
        """The adapter is unplugged."""
        if self._theirs is None:
            return
        os.write(self._stop_writes, b"x")
        self._thread.join(5)
        for descriptor in (self._ours, self._theirs, self._stop_writes):
            os.close(descriptor)
        self._theirs = None

    def _serve(self) -> None:
        stream = bytearray()
        while True:
            ready, _, _ = select.select([self._ours, self._stop_reads], [], [])
            if self._stop_reads in ready:
                return
            with contextlib.suppress(OSError):
                stream += os.read(self._ours, 4096)
            for motor, code, params in self.taken(stream):
                self.instructions.append((motor, code, params))
                self.heard(motor, code, params)
                self._obey(motor, code, params)

    def _obey(self, motor: int, code: int, params: bytes) -> None:
        size = self.address_size

        def number(at: int) -> int:
            return int.from_bytes(params[at : at + size], "little")

        match code:
            case 0x01:
                self._reply(motor, self.greeting)
            case 0x02:
                self._reply_with(motor, number(0), number(size))
            case 0x03:
                self._write(motor, number(0), params[size:])
                self._reply(motor, b"")
            case 0x82:
                for one in params[2 * size :]:
                    self._reply_with(one, number(0), number(size))
            case 0x83:
                self._write_all(number(0), number(size), params[2 * size :])
            case _:
                self.complaints.append(f"unknown instruction {code:#x}")

    def _write_all(self, address: int, size: int, data: bytes) -> None:
        if len(data) % (size + 1):
            self.complaints.append("a sync write that does not come out even")
        for at in range(0, len(data), size + 1):
            self._write(data[at], address, data[at + 1 : at + 1 + size])

    def _write(self, motor: int, address: int, data: bytes) -> None:
        servo = self.motors.get(motor)
        if servo is None:
            return
        servo.registers[address : address + len(data)] = data
        if address == self.goal[0] and self.follows:
            servo.put(self.present[0], servo.get(*self.goal), self.present[1])

    def _reply_with(self, motor: int, address: int, size: int) -> None:
        servo = self.motors.get(motor)
        if servo is not None:
            self._reply(motor, bytes(servo.registers[address : address + size]))

    def _reply(self, motor: int, data: bytes) -> None:
        if motor not in self.motors or self._spend(self.drops, motor):
            return
        packet = bytearray(self.status(motor, self.motors[motor].error, data))
        if self._spend(self.breaks, motor):
            packet[-1] ^= 0x55
        with contextlib.suppress(OSError):
            os.write(self._ours, self.noise + packet)

    @staticmethod
    def _spend(budget: dict[int, int], motor: int) -> bool:
        left = budget.get(motor, 0)
        budget[motor] = max(0, left - 1)
        return left > 0

    # -- the protocol: Feetech's, spelt from its manual --------------------------------------------------------------

    greeting = b""

    def taken(self, stream: bytearray) -> Iterator[tuple[int, int, bytes]]:
        while len(stream) >= 4 and len(stream) >= stream[3] + 4:
            size = stream[3] + 4
            packet = bytes(stream[:size])
            del stream[:size]
            if packet[:2] != b"\xff\xff" or (sum(packet[2:]) & 0xFF) != 0xFF:
                self.complaints.append(f"a broken packet: {packet.hex(' ')}")
                continue
            yield packet[2], packet[4], packet[5:-1]

    def status(self, motor: int, error: int, data: bytes) -> bytes:
        body = bytes([motor, len(data) + 2, error]) + data
        return b"\xff\xff" + body + bytes([0xFF - sum(body) % 256])


class DynamixelChain(ServoChain):
    """The same with protocol 2."""

    address_size = 2
    goal = (116, 4)
    present = (132, 4)
    greeting = b"\x06\x04\x26"

    def taken(self, stream: bytearray) -> Iterator[tuple[int, int, bytes]]:
        while len(stream) >= 7 and len(stream) >= (size := stream[5] + 256 * stream[6] + 7):
            packet = bytes(stream[:size])
            del stream[:size]
            if packet[:4] != b"\xff\xff\xfd\x00" or bitwise_crc(packet[:-2]) != packet[-2] + 256 * packet[-1]:
                self.complaints.append(f"a broken packet: {packet.hex(' ')}")
                continue
            yield packet[4], packet[7], packet[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")

    def status(self, motor: int, error: int, data: bytes) -> bytes:
        content = (bytes([0x55, error]) + data).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
        packet = b"\xff\xff\xfd\x00" + bytes([motor, (len(content) + 2) % 256, (len(content) + 2) // 256]) + content
        crc = bitwise_crc(packet)
        return packet + bytes([crc % 256, crc // 256])


def bitwise_crc(data: bytes) -> int:
    """The polynomial division by the book, bit by bit."""
    register = 0
    for bit in (byte >> shift & 1 for byte in data + b"\0\0" for shift in range(7, -1, -1)):
        register = register << 1 | bit
        if register & 0x10000:
            register ^= 0x18005
    return register
