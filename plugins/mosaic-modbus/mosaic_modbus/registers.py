"""The ``modbus-registers`` connector: numbers out of a device's registers, as one typed message."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.made_message import MadeField, check_names, made_message, with_message
from mosaic_core.contract.params import Params
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.words.data_type import Delivery
from mosaic_modbus.kept_line import KeptLine, shared_line
from mosaic_modbus.numbers import decoded, is_whole
from mosaic_modbus.params import MAX_FIELDS, ModbusLineParams, RegisterField
from mosaic_modbus.plan import Block, read_plan
from mosaic_modbus.port import DeviceSaidNo

_log = logging.getLogger(__name__)


class ModbusRegistersParams(Params):
    line: ModbusLineParams = Field(
        default_factory=ModbusLineParams, description="The line; the same for all its connectors."
    )
    device_id: int = Field(default=1, ge=1, le=247, description="The device's number (unit id) on the line.")
    fields: dict[str, RegisterField] = Field(min_length=1, max_length=MAX_FIELDS, description="The message, by name.")
    rate_hz: float = Field(default=2.0, gt=0, le=100, description="Readings per second.")
    max_gap: int = Field(
        default=0, ge=0, le=100, description="Read so many that nobody asked for, to need fewer requests."
    )

    @field_validator("fields")
    @classmethod
    def _have_names(cls, fields: dict[str, RegisterField]) -> dict[str, RegisterField]:
        check_names(fields)
        return fields


class ModbusRegisters(DataChannelSendable[Any]):
    """Reads all fields at a steady rate. Those that the device refuses to tell are null."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: ModbusRegistersParams, line: KeptLine) -> None:
        super().__init__(label)
        self._params = params
        self._line = line
        self._blocks = read_plan(params.fields, params.max_gap)
        self._complaints = ComplaintPace()

    def messages(self) -> Iterator[Any]:
        for _ in self.every(1 / self._params.rate_hz):
            if not self._line.is_open and self._line.keeper.absence is None:
                continue  # it is being opened
            values = self._reading()
            if values is not None:
                yield values

    def _reading(self) -> dict[str, Any] | None:
        """Raises :class:`DeviceGone`."""
        values: dict[str, Any] = dict.fromkeys(self._params.fields)
        told = 0
        for block in self._blocks:
            try:
                words = self._line.read(self._params.device_id, block)
            except DeviceSaidNo as error:
                self._complain(block, error)
                continue
            told += 1
            values.update(self._values(block, words))
        return values if told else None

    def _values(self, block: Block, words: Sequence[int]) -> Iterator[tuple[str, Any]]:
        for name in block.names:
            field = self._params.fields[name]
            yield name, decoded(field, block.words_of(field, words))

    def _complain(self, block: Block, error: DeviceSaidNo) -> None:
        """Counted each time, logged once in a while."""
        self.count_loss("refused")
        if self._complaints.is_due(block, self.monotonic_s()):
            where = f"{self._params.line.source}, device {self._params.device_id}"
            _log.warning("%s: %s refused %s: %s; look at address and kind", self.label, where, block, error)


def _read_field(field: RegisterField) -> MadeField:
    kind: Any = bool if field.number_type == "boolean" else int if is_whole(field) else float
    return MadeField(kind | None, field.unit, field.description, default=None)


class ModbusRegistersConfigurer(DataChannelConfigurer[ModbusRegistersParams]):
    """Numbers out of a Modbus device's registers, over TCP or RTU."""

    connector_type = "modbus-registers"
    example: ClassVar[dict[str, Any] | None] = {
        "line": {"source": "tcp://192.168.0.10:502"},
        "fields": {
            "voltage_v": {"address": 0, "kind": "input", "scale": 0.1},
            "is_running": {"address": 0, "kind": "coil"},
        },
    }
    trial: ClassVar[dict[str, Any] | None] = {
        "line": {"source": "fake"},
        "rate_hz": 10,
        "fields": {
            "voltage_v": {"address": 0, "kind": "input", "scale": 0.1},
            "is_running": {"address": 0, "kind": "coil"},
        },
    }

    def configure(self) -> ModbusRegisters:
        model = made_message("ModbusReading", {name: _read_field(one) for name, one in self.params.fields.items()})
        made = with_message(ModbusRegisters, model, DataChannelSendable)
        return made(self.label, self.params, shared_line(self.params.line, self.shared))
