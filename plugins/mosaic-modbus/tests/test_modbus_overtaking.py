"""A command that waits for its turn is not written after the safe values that went before it."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import pytest

from mosaic_core.words.errors import Refused
from mosaic_modbus.kept_line import KeptLine
from mosaic_modbus.params import ModbusLineParams, WriteField
from mosaic_modbus.plan import Block, Write
from mosaic_modbus.port import ModbusPort
from mosaic_modbus.safe_writer import SafeWriter


class SlowPort(ModbusPort):
    """Takes time to read; what is written is kept."""

    def __init__(self) -> None:
        self.is_reading, self.goes_on = threading.Event(), threading.Event()
        self.written: list[tuple[int, ...]] = []

    def open(self) -> None: ...

    def read(self, device_id: int, block: Block) -> Sequence[int]:
        self.is_reading.set()
        assert self.goes_on.wait(10)
        return [0]

    def write(self, device_id: int, write: Write) -> None:
        self.written.append(write.words)

    def close(self) -> None: ...


def test_a_command_that_waited_while_a_stop_went_first_is_dropped() -> None:
    port, refused = SlowPort(), []
    line = KeptLine(ModbusLineParams(source="fake"), opens=lambda _: port)
    writer = SafeWriter(line, 1, {"speed": WriteField(address=4, type="int16", motion="velocity", min=-9, max=9)})
    line.open()
    line.pay()

    def command() -> None:
        with pytest.raises(Refused) as error:
            writer.command({"speed": 7})
        refused.append(error.value.code)

    threads = [threading.Thread(target=line.read, args=(1, Block("holding", 0, 1, ())))]
    threads[0].start()
    assert port.is_reading.wait(10)
    for waits, act in enumerate((command, writer.make_safe), 1):
        threads.append(threading.Thread(target=act))
        threads[-1].start()
        while line.waiting < waits:
            pass
    port.goes_on.set()
    for one in threads:
        one.join(10)
    assert refused == ["safety.stopped"]
    assert port.written == [(0,), (0,)]
