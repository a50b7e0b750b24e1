"""The ``serial-json`` connector: a device on a serial line that says, and takes, one JSON object a line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Any, ClassVar

from pydantic import Field, ValidationError, model_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.described_message import CommandField, DescribedField, message_of
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable, Handler
from mosaic_core.contract.made_message import check_names, with_message
from mosaic_core.contract.params import Message
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.wire_model import parsed_object, to_json, told_mistakes
from mosaic_sensors.serial_lines.fake_device import FakeJsonDevice
from mosaic_sensors.serial_lines.link import SILENCE_S, LineLink
from mosaic_sensors.serial_lines.params import LineParams
from mosaic_sensors.serial_lines.reader import LineReader

MAX_FIELDS = 64


class SerialJsonParams(LineParams):
    fields: dict[str, DescribedField] = Field(
        default={}, max_length=MAX_FIELDS, description="The keys of a line; default: any object is sent as it is."
    )
    commands: dict[str, CommandField] = Field(
        default={}, max_length=MAX_FIELDS, description="The keys of a command; default: it takes none."
    )
    safe: dict[str, float | bool | str] = Field(
        default={}, description="What the safe line says beside 0 for each velocity of `commands`."
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> SerialJsonParams:
        check_names(self.fields)
        check_names(self.commands)
        unknown = [key for key in self.safe if key not in self.commands]
        if unknown:
            raise ValueError(f"safe: {', '.join(unknown)}: not among the commands")
        try:
            message_of("Safe", {key: self.commands[key] for key in self.safe}).model_validate(self.safe)
        except ValidationError as error:
            raise ValueError(f"safe: {told_mistakes(error)}") from None
        return self

    @property
    def safe_line(self) -> bytes | None:
        """What brings the device into its safe state, if anything does."""
        zeros = {key: 0.0 for key, field in self.commands.items() if field.kind == "velocity"}
        safe = {**zeros, **self.safe}
        return to_json(safe).encode() if safe else None

    @property
    def moves(self) -> bool:
        """Whether a command moves something."""
        return any(field.kind is not None for field in self.commands.values())


class SerialJson(DataChannelSendable[Any]):
    """Sends a message per line, and carries the commands of :class:`SerialJsonCommands`."""

    def __init__(
        self, label: str, params: SerialJsonParams, link: LineLink, model: type[Message] | None = None
    ) -> None:
        super().__init__(label)
        self._model = model
        self.reader = LineReader(self, params, link, lambda: FakeJsonDevice(params.fields))

    def messages(self) -> Iterator[Any]:
        with closing(self.reader.lines()) as lines:
            for line in lines:
                try:
                    message = parsed_object(line)
                    yield message if self._model is None else self._model.model_validate(message)
                except ValidationError as error:
                    self.reader.refuse(told_mistakes(error))
                except ValueError as error:
                    self.reader.refuse(error)


class SerialJsonCommands(DataChannelReceivable[Any]):
    """Writes a line per command; silence, a lost operator and a stop write the safe line."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    requires_lease = True

    def __init__(self, label: str, params: SerialJsonParams, link: LineLink) -> None:
        super().__init__(label)
        self.timeout_s = SILENCE_S if params.moves else None
        self._link = link

    def handle_data(self, data: Message) -> None:
        """Receiver's thread."""
        self._link.write(to_json(data.model_dump(mode="json")).encode() + b"\n")

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._link.make_safe()


class SerialJsonConfigurer(DataChannelConfigurer[SerialJsonParams]):
    """A device on a serial line that says, and takes, one JSON object a line."""

    connector_type = "serial-json"
    example: ClassVar[dict[str, Any] | None] = {"source": "/dev/ttyUSB0", "fields": {"voltage_v": {}}}
    trial: ClassVar[dict[str, Any] | None] = {
        "source": "fake",
        "fields": {"voltage_v": {}, "left_mps": {}},
        "commands": {"left_mps": {"kind": "velocity"}, "lamp": {"type": "boolean"}},
        "safe": {"lamp": False},
    }

    def configure(self) -> Sequence[Handler]:
        params, link = self.params, LineLink(self.params.safe_line)
        return [self._sender(params, link), *self._receivers(params, link)]

    def _sender(self, params: SerialJsonParams, link: LineLink) -> SerialJson:
        if not params.fields:
            return SerialJson(self.label, params, link)
        model = message_of("SerialLine", params.fields)
        return with_message(SerialJson, model, DataChannelSendable)(self.label, params, link, model)

    def _receivers(self, params: SerialJsonParams, link: LineLink) -> Iterator[SerialJsonCommands]:
        if params.commands:
            model = message_of("SerialCommand", params.commands)
            yield with_message(SerialJsonCommands, model, DataChannelReceivable)(f"{self.label}_command", params, link)
