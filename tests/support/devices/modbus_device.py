"""A Modbus device of pymodbus: a real server on TCP, or on a serial line of two pseudo terminals."""

from __future__ import annotations

import asyncio
import os
import select
import threading
import tty
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from pymodbus import FramerType
from pymodbus.constants import ExcCodes
from pymodbus.pdu import ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.testing import build
from mosaic_modbus.kept_line import KeptLine
from mosaic_modbus.params import ModbusLineParams

COUNT = 32
"""Of each of its four tables: what lies beyond is an illegal address."""


class ModbusDevice:
    """A server on a thread of its own, which can be switched off and on. ``asked`` is what it was asked for: function,
    address, and the values that it was told or how many it was to tell."""

    def __init__(self, make: Callable[[ModbusDevice, SimDevice], Any]) -> None:
        self._make = make
        self.asked: list[tuple[int, int, Any]] = []
        self.says_no: ExcCodes | None = None
        """Answer all that comes with this exception."""
        self.holding = list(range(COUNT))
        self.input = [1000 + at for at in range(COUNT)]
        self.coil = [False] * COUNT
        self._loop: asyncio.AbstractEventLoop | None = None
        self._server: Any = None
        self._thread: threading.Thread | None = None

    def switch_on(self) -> None:
        ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(ready)), daemon=True)
        self._thread.start()
        assert ready.wait(10)

    async def _serve(self, ready: threading.Event) -> None:
        self._loop = asyncio.get_running_loop()
        tables = (
            [SimData(0, values=list(self.coil), datatype=DataType.BITS)],
            [SimData(0, values=[at % 2 == 0 for at in range(COUNT)], datatype=DataType.BITS)],
            [SimData(0, values=list(self.holding), datatype=DataType.REGISTERS)],
            [SimData(0, values=list(self.input), datatype=DataType.REGISTERS)],
        )
        self._server = self._make(self, SimDevice(1, simdata=tables, action=self._act))
        await self._server.serve_forever(background=True)
        ready.set()
        with suppress(asyncio.CancelledError):
            await self._server.serving

    async def _act(self, *_: Any) -> ExcCodes | None:
        return self.says_no

    def hear(self, is_answer: bool, pdu: ModbusPDU) -> ModbusPDU:
        """A request, or its answer. The server's thread."""
        if not is_answer:
            told = list(pdu.registers or pdu.bits)
            self.asked.append((pdu.function_code, pdu.address, told or pdu.count))
        return pdu

    def written(self) -> list[tuple[int, int, Any]]:
        """What was written since the last call."""
        found = [one for one in self.asked if one[0] in (5, 6, 15, 16)]
        self.asked.clear()
        return found

    def switch_off(self) -> None:
        if self._loop is not None and self._thread is not None:
            asyncio.run_coroutine_threadsafe(self._server.shutdown(), self._loop).result(10)
            self._thread.join(10)
            self._loop = self._thread = None


def tcp_device(port: int, framer: FramerType = FramerType.SOCKET) -> ModbusDevice:
    """One that listens on this port of the loopback."""
    return ModbusDevice(
        lambda its, sim: ModbusTcpServer(sim, address=("127.0.0.1", port), framer=framer, trace_pdu=its.hear)
    )


class SerialCable:
    """Two pseudo terminals, joined: one end for the device, ``port`` for the robot. It can be cut and garbled."""

    def __init__(self) -> None:
        self.is_cut = False
        self.noise = b""
        """Put before the next thing that the device says."""
        self._ours: list[int] = []
        self._others: list[int] = []
        names = []
        for _ in range(2):
            ours, other = os.openpty()
            tty.setraw(other)
            self._ours.append(ours)
            self._others.append(other)
            names.append(os.ttyname(other))
        self.device_end, self.port = names
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        device, robot = self._ours
        while not self._is_over.is_set():
            for one in select.select(self._ours, [], [], 0.02)[0]:
                data = os.read(one, 4096)
                if self.is_cut:
                    continue
                if one == device and self.noise:
                    data, self.noise = self.noise + data, b""
                os.write(robot if one == device else device, data)

    def close(self) -> None:
        self._is_over.set()
        self._thread.join(5)
        for one in (*self._ours, *self._others):
            os.close(one)


def serial_device(cable: SerialCable) -> ModbusDevice:
    """One at the end of this cable."""
    return ModbusDevice(
        lambda its, sim: ModbusSerialServer(
            sim, port=cable.device_end, baudrate=19_200, framer=FramerType.RTU, trace_pdu=its.hear
        )
    )


class Lines:
    """Makes handlers on lines without a thread: a test opens them as a line's own thread would."""

    def __init__(self) -> None:
        self._made: list[KeptLine] = []

    def build(self, configurer: Any, source: str, *, timeout_s: float = 2.0, safety: Any = None, **params: Any) -> Any:
        """The line, and a handler on it."""
        its = ModbusLineParams(source=source, timeout_s=timeout_s, parity="none")
        line, shared = KeptLine(its), Shared()
        self._made.append(line)
        shared.get(f"mosaic-modbus:{source}", lambda: line)
        return line, build(configurer, params={"line": its.model_dump(), **params}, safety=safety, shared=shared)

    def close(self) -> None:
        for line in self._made:
            line.close()
