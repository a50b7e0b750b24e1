"""The power meter, against an instrument that this test plays on a real socket."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from acme_workbench.power_meter import Power, PowerMeterConfigurer

from mosaic_core import DeviceGone
from mosaic_core.testing import build, collect

ANSWERS = {b"MEAS:VOLT?\n": b"12.5\n", b"MEAS:CURR?\n": b"0.25\n"}


@contextmanager
def instrument(answers: dict[bytes, bytes]) -> Iterator[int]:
    """Its port; it runs on a loop and a thread of its own, as the kit gives the handler one."""
    loop = asyncio.new_event_loop()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while question := await reader.readline():
            writer.write(answers[question])
        writer.close()

    server = loop.run_until_complete(asyncio.start_server(serve, "127.0.0.1"))
    thread = threading.Thread(target=loop.run_forever, name="instrument")
    thread.start()
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        server.close()
        loop.run_until_complete(asyncio.sleep(0))
        loop.close()


def test_it_reads_voltage_and_current() -> None:
    with instrument(ANSWERS) as port:
        meter = build(PowerMeterConfigurer, params={"host": "127.0.0.1", "port": port, "period_s": 60})
        assert collect(meter, 2) == [Power(voltage_v=12.5, current_a=0.25)] * 2


def test_an_instrument_that_is_made_up_answers_too() -> None:
    assert collect(build(PowerMeterConfigurer, params={"host": "made-up"}), 1) == [Power(voltage_v=12, current_a=0.5)]


def test_what_is_no_number_is_a_device_that_is_gone() -> None:
    with instrument({b"MEAS:VOLT?\n": b"OVLD\n"}) as port:
        meter = build(PowerMeterConfigurer, params={"host": "127.0.0.1", "port": port})
        with pytest.raises(DeviceGone, match="does not answer"):
            collect(meter, 1)


def test_an_answer_without_end_is_not_kept() -> None:
    with instrument({b"MEAS:VOLT?\n": b"1" * 100_000}) as port:
        meter = build(PowerMeterConfigurer, params={"host": "127.0.0.1", "port": port})
        with pytest.raises(DeviceGone, match="does not answer"):
            collect(meter, 1)


def test_an_instrument_that_is_off_is_a_device_that_is_gone() -> None:
    with instrument(ANSWERS) as port:
        pass
    with pytest.raises(DeviceGone, match=f"no instrument answers at 127.0.0.1:{port}"):
        collect(build(PowerMeterConfigurer, params={"host": "127.0.0.1", "port": port}), 1)
