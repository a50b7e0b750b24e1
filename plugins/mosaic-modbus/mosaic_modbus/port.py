"""Carries one request at a time to a device, with pymodbus."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any, Protocol
from urllib.parse import urlsplit

from pymodbus import FramerType, ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from mosaic_modbus.params import DEFAULT_PORT, RTU_OVER_TCP, ModbusLineParams
from mosaic_modbus.plan import Block, Write

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
"""It writes a line for every request that fails; ours are written once when something is lost."""
EXCEPTIONS = {
    1: "illegal function", 2: "illegal data address", 3: "illegal data value", 4: "device failure", 5: "acknowledge",
    6: "device busy", 7: "negative acknowledge", 8: "memory parity error", 10: "gateway path unavailable",
    11: "gateway target failed to respond",
}  # fmt: skip
"""Section 7 of the Modbus Application Protocol, V1.1b3."""


class DeviceSaidNo(Exception):
    """The device answers with an exception; ``code`` is its number."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{EXCEPTIONS.get(code, 'unknown exception')} (exception {code})")
        self.code = code


class NoAnswer(Exception):
    """The device is silent, or what came makes no sense as an answer."""


class ModbusPort(Protocol):
    """A line that may be open. Requests raise :class:`DeviceSaidNo`, :class:`NoAnswer`, and :class:`OSError` when the
    line is lost."""

    def open(self) -> None:
        """Raises :class:`OSError`."""
        ...

    def read(self, device_id: int, block: Block) -> Sequence[int]: ...

    def write(self, device_id: int, write: Write) -> None: ...

    def close(self) -> None: ...


class PymodbusPort:
    """A line on a serial port or a TCP connection."""

    def __init__(self, params: ModbusLineParams) -> None:
        self._name = params.source
        self._client = _client_of(params)

    def open(self) -> None:
        if not self._client.connect():
            raise OSError("nobody is there, or it may not be opened")

    def read(self, device_id: int, block: Block) -> Sequence[int]:
        its = self._client
        reads: dict[str, Any] = {
            "holding": its.read_holding_registers, "input": its.read_input_registers, "coil": its.read_coils,
            "discrete": its.read_discrete_inputs,
        }  # fmt: skip
        answer = self._asked(reads[block.kind], block.address, count=block.count, device_id=device_id)
        words: list[int] = answer.registers if block.kind in ("holding", "input") else answer.bits
        if len(words) < block.count:
            raise NoAnswer(f"{len(words)} values instead of {block.count}")
        return words

    def write(self, device_id: int, write: Write) -> None:
        """One value by function 5 or 6, several by 15 or 16."""
        its, is_coil, values = self._client, write.kind == "coil", list(write.words)
        if len(values) > 1:
            many: Any = its.write_coils if is_coil else its.write_registers
            self._asked(many, write.address, [bool(one) for one in values] if is_coil else values, device_id=device_id)
        else:
            one: Any = its.write_coil if is_coil else its.write_register
            self._asked(one, write.address, bool(values[0]) if is_coil else values[0], device_id=device_id)

    def _asked(self, ask: Any, *words: Any, **options: Any) -> Any:
        try:
            answer = ask(*words, **options)
        except ConnectionException as error:
            raise OSError(f"{self._name} is not connected any more") from error
        except ModbusException as error:
            raise NoAnswer(error.string) from error
        if answer.isError():
            raise DeviceSaidNo(answer.exception_code)
        return answer

    def close(self) -> None:
        self._client.close()  # type: ignore[no-untyped-call]


def _client_of(params: ModbusLineParams) -> ModbusTcpClient | ModbusSerialClient:
    if "://" in params.source:
        url = urlsplit(params.source)
        framer = FramerType.RTU if url.scheme == RTU_OVER_TCP else FramerType.SOCKET
        return ModbusTcpClient(
            url.hostname or "", port=url.port or DEFAULT_PORT, framer=framer, timeout=params.timeout_s, retries=0
        )
    return ModbusSerialClient(
        params.source, baudrate=params.baud, parity=params.parity[0].upper(), stopbits=params.stop_bits,
        timeout=params.timeout_s, retries=0,
    )  # fmt: skip
