"""The ``power-meter`` connector: an instrument that is asked over TCP (SCPI), on the event loop.

An ``async`` body needs no thread. It may only wait for what can be awaited: one blocking call would hold up everything
else of the robot, and belongs into a plain ``def`` as in `acme_workbench/thermometer.py`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery, DeviceGone, Message, Params, unit

ANSWER_WITHIN_S = 2.0
LONGEST_ANSWER_BYTES = 256
MADE_UP = "made-up"


class PowerMeterParams(Params):
    host: str = Field(
        description="Address of the instrument. `made-up`: one that is not there, of 12 V.", examples=["192.168.1.40"]
    )
    port: int = Field(default=5025, ge=1, le=65535, description="Port for SCPI; 5025 on most instruments.")
    period_s: float = Field(default=1.0, gt=0, description="Seconds between two readings.")


class Power(Message):
    voltage_v: float = Field(json_schema_extra=unit("V"))
    current_a: float = Field(json_schema_extra=unit("A"))


class PowerMeter(DataChannelSendable[Power]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: PowerMeterParams) -> None:
        super().__init__(label)
        self.params = params

    async def messages(self) -> AsyncIterator[Power]:
        if self.params.host == MADE_UP:
            async for _ in self.every(self.params.period_s):
                yield Power(voltage_v=12.0, current_a=0.5)
            return
        async with self._connected() as instrument:
            async for _ in self.every(self.params.period_s):
                voltage_v, current_a = await instrument.ask(("MEAS:VOLT?", "MEAS:CURR?"))
                yield Power(voltage_v=voltage_v, current_a=current_a)

    @asynccontextmanager
    async def _connected(self) -> AsyncIterator[Instrument]:
        """Closed with the body, and opened anew by the next try. Raises :class:`DeviceGone`."""
        place = f"{self.params.host}:{self.params.port}"
        try:
            reader, writer = await asyncio.wait_for(
                asyncio.open_connection(self.params.host, self.params.port, limit=LONGEST_ANSWER_BYTES), ANSWER_WITHIN_S
            )
        except (OSError, TimeoutError) as error:
            raise DeviceGone(f"no instrument answers at {place}", "switch it on, or look at its address") from error
        try:
            yield Instrument(place, reader, writer)
        finally:
            writer.close()


class Instrument:
    """An open connection to the instrument at ``place``."""

    def __init__(self, place: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._place, self._reader, self._writer = place, reader, writer

    async def ask(self, questions: Sequence[str]) -> list[float]:
        """The numbers that it answers. Raises :class:`DeviceGone` where it hangs up, is silent or says no number."""
        try:
            return [await asyncio.wait_for(self._answer(question), ANSWER_WITHIN_S) for question in questions]
        except (OSError, TimeoutError, ValueError) as error:
            raise DeviceGone(f"the instrument at {self._place} does not answer", "look at its display") from error

    async def _answer(self, question: str) -> float:
        self._writer.write(f"{question}\n".encode())
        await self._writer.drain()
        return float(await self._reader.readline())


class PowerMeterConfigurer(DataChannelConfigurer[PowerMeterParams]):
    """Voltage and current of an instrument that speaks SCPI."""

    connector_type = "power-meter"
    trial: ClassVar[dict[str, Any] | None] = {"host": "made-up"}

    def configure(self) -> PowerMeter:
        return PowerMeter(self.label, self.params)
