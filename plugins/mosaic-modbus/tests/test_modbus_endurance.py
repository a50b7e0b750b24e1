"""Servers that say anything but what they were asked: nothing but an answer, a refusal or silence comes of it."""

from __future__ import annotations

import random
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from mosaic_modbus.params import ModbusLineParams
from mosaic_modbus.plan import Block, Write
from mosaic_modbus.port import DeviceSaidNo, NoAnswer, PymodbusPort

Says = Callable[[socket.socket, bytes], None]
REQUESTS = 150


@contextmanager
def server(says: Says) -> Iterator[PymodbusPort]:
    """A line to a server that answers each request with ``says``."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        threading.Thread(target=serve, args=(listening, says), daemon=True).start()
        port = PymodbusPort(ModbusLineParams(source=f"tcp://127.0.0.1:{listening.getsockname()[1]}", timeout_s=0.05))
        try:
            yield port
        finally:
            port.close()
            listening.shutdown(socket.SHUT_RDWR)


def serve(listening: socket.socket, says: Says) -> None:
    with suppress(OSError):
        while True:
            connection, _ = listening.accept()
            with connection, suppress(OSError):
                while request := connection.recv(1024):
                    says(connection, request)


def nonsense(chance: random.Random) -> Says:
    """Of any shape, mostly so that it looks like an answer at first."""

    def says(connection: socket.socket, request: bytes) -> None:
        function = request[7]
        body = chance.choice([
            chance.randbytes(chance.randrange(12)),
            bytes([function]) + chance.randbytes(chance.randrange(12)),
            bytes([function, chance.randrange(256)]) + chance.randbytes(chance.randrange(30)),
            bytes([function | 0x80]) + chance.randbytes(chance.randrange(2)),
            bytes([chance.randrange(256)]) + chance.randbytes(chance.randrange(20)),
        ])  # fmt: skip
        length = len(body) + 1 if chance.random() < 0.8 else chance.randrange(65_536)
        connection.sendall(request[:4] + struct.pack(">H", length) + request[6:7] + body)

    return says


def test_whatever_a_server_says_is_an_answer_a_refusal_or_silence() -> None:
    chance = random.Random(1)
    with server(nonsense(chance)) as port:
        for _ in range(REQUESTS):
            port.close()
            port.open()
            with suppress(NoAnswer, DeviceSaidNo, OSError):
                block = Block(chance.choice(("holding", "input", "coil", "discrete")), 0, 4, ())
                assert len(port.read(1, block)) >= block.count
            with suppress(NoAnswer, DeviceSaidNo, OSError):
                port.write(1, Write(chance.choice(("holding", "coil")), 0, chance.choice(((1,), (1, 0, 1)))))


def test_a_server_that_never_stops_talking_is_silent_in_time() -> None:
    is_over = threading.Event()

    def says(connection: socket.socket, request: bytes) -> None:
        while not is_over.is_set():
            connection.sendall(b"\xff" * 4096)

    with server(says) as port:
        port.open()
        with pytest.raises((NoAnswer, OSError)):
            port.read(1, Block("holding", 0, 4, ()))
        is_over.set()
