"""The ``modbus-write`` connector: an operator's numbers into a device's registers, within limits."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.made_message import MadeField, check_names, made_message, with_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.safety_config import FieldBounds
from mosaic_modbus.kept_line import shared_line
from mosaic_modbus.numbers import bounds, encoded, is_whole
from mosaic_modbus.params import MAX_FIELDS, ModbusLineParams, WriteField
from mosaic_modbus.plan import overlap
from mosaic_modbus.safe_writer import SafeWriter, safe_values

SILENCE_S = 0.5
"""Without a command for so long, what moves is told to stand still."""


class ModbusWriteParams(Params):
    line: ModbusLineParams = Field(
        default_factory=ModbusLineParams, description="The line; the same for all its connectors."
    )
    device_id: int = Field(default=1, ge=1, le=247, description="The device's number (unit id) on the line.")
    fields: dict[str, WriteField] = Field(min_length=1, max_length=MAX_FIELDS, description="A command, by name.")

    @model_validator(mode="after")
    def _can_be_followed(self) -> Self:
        check_names(self.fields)
        both = overlap(self.fields)
        if both is not None:
            raise ValueError(f"{both[0]} and {both[1]} lie in the same register")
        for name, field in self.fields.items():
            if field.kind == "holding":
                _check_range(name, field)
        for name, value in safe_values(self.fields):
            try:
                encoded(self.fields[name], value)
            except ValueError as error:
                raise ValueError(f"{name}: safe: {error}") from None
        return self


def _check_range(name: str, field: WriteField) -> None:
    low, high = bounds(field)
    if low > high:
        raise ValueError(f"{name}: min and max leave nothing that its register holds")
    if field.motion == "velocity" and not low <= 0 <= high:
        raise ValueError(f"{name} goes from {low:g} to {high:g}, and 0 must stand still")


class ModbusWrite(DataChannelReceivable[Any]):
    """Writes each command; silence, a lost operator and a stop write the safe values."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    requires_lease = True

    def __init__(self, label: str, params: ModbusWriteParams, writer: SafeWriter) -> None:
        super().__init__(label)
        moving = {name: one for name, one in params.fields.items() if one.motion}
        self.timeout_s = SILENCE_S if moving else None
        self.limits = {name: FieldBounds(min=bounds(one)[0], max=bounds(one)[1]) for name, one in moving.items()}
        self._writer, self.keeper = writer, writer.keeper

    def handle_data(self, data: Message) -> None:
        """Receiver's thread."""
        self._writer.command(data.model_dump())

    def make_safe(self, cause: str) -> None:
        """Safety thread: waits for the request that is on its way, then for its own."""
        self._writer.make_safe()


def _command_field(field: WriteField) -> MadeField:
    if field.kind == "coil":
        return MadeField(bool, None, field.description)
    low, high = bounds(field)
    kind = int if is_whole(field) and field.motion is None else float
    return MadeField(kind, field.unit, field.description, field.motion, low, high)


_FIELDS: dict[str, Any] = {
    "speed_rpm": {"address": 0, "type": "int16", "motion": "velocity", "min": -1500, "max": 1500},
    "enable": {"address": 0, "kind": "coil", "safe": False},
}


class ModbusWriteConfigurer(DataChannelConfigurer[ModbusWriteParams]):
    """An operator's numbers into a Modbus device's registers and coils, within limits."""

    connector_type = "modbus-write"
    example: ClassVar[dict[str, Any] | None] = {"line": {"source": "tcp://192.168.0.10:502"}, "fields": _FIELDS}
    trial: ClassVar[dict[str, Any] | None] = {"line": {"source": "fake"}, "fields": _FIELDS}

    def configure(self) -> ModbusWrite:
        one = self.params
        model = made_message("ModbusCommand", {name: _command_field(field) for name, field in one.fields.items()})
        made = with_message(ModbusWrite, model, DataChannelReceivable)
        return made(self.label, one, SafeWriter(shared_line(one.line, self.shared), one.device_id, one.fields))
