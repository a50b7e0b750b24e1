"""The ``serial-text`` connector: a device on a serial line that says lines of text, and takes some lines by heart.

What an operator may say is a list: nothing could limit free text.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StringConstraints, create_model

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable, Handler
from mosaic_core.contract.made_message import with_message
from mosaic_core.contract.params import Message
from mosaic_sensors.serial_lines.fake_device import FakeTextDevice
from mosaic_sensors.serial_lines.link import SILENCE_S, LineLink
from mosaic_sensors.serial_lines.params import LineParams
from mosaic_sensors.serial_lines.reader import LineReader

MAX_COMMANDS = 64
Line = Annotated[str, StringConstraints(min_length=1, max_length=256, pattern=r"^[\x20-\x7e]+$")]
"""Printable ASCII: what ends a line or rings a bell is no part of it."""


class SerialTextParams(LineParams):
    commands: tuple[Line, ...] = Field(
        default=(), max_length=MAX_COMMANDS, description="The lines that an operator may say; default: none."
    )
    safe: Line | None = Field(
        default=None,
        description="The line that brings what the commands move into its safe state: it is said on an operator's "
        "silence (0.5 s, or safety.timeout_s), on stop and at both ends. Without it they move nothing.",
    )

    @property
    def safe_line(self) -> bytes | None:
        """The safe line as bytes."""
        return None if self.safe is None else self.safe.encode()


class TextCommand(Message):
    """One of the lines that the file names: of each robot another choice, and no other line gets here."""

    line: str = Field(max_length=256)


class SerialText(DataChannelSendable[str]):
    """Sends a text per line, and carries the commands of :class:`SerialTextCommands`."""

    def __init__(self, label: str, params: SerialTextParams, link: LineLink) -> None:
        super().__init__(label)
        self.reader = LineReader(self, params, link, FakeTextDevice)

    def messages(self) -> Iterator[str]:
        with closing(self.reader.lines()) as lines:
            for line in lines:
                try:
                    yield line.decode()
                except UnicodeDecodeError as error:
                    self.reader.refuse(f"no UTF-8: {error.reason}")


class SerialTextCommands(DataChannelReceivable[TextCommand]):
    """Writes one of the lines that the file names. They move nothing."""

    requires_lease = True
    motion_fields: ClassVar[tuple[str, ...]] = ()

    def __init__(self, label: str, link: LineLink) -> None:
        super().__init__(label)
        self._link = link

    def handle_data(self, data: TextCommand) -> None:
        """Receiver's thread."""
        self._link.write(data.line.encode() + b"\n")


class SerialTextMotion(SerialTextCommands):
    """The same of lines that move something: silence, a lost operator and a stop say the safe line."""

    timeout_s = SILENCE_S

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._link.make_safe()


class SerialTextConfigurer(DataChannelConfigurer[SerialTextParams]):
    """A device on a serial line that says lines of text, and takes those that the file names."""

    connector_type = "serial-text"
    example: ClassVar[dict[str, Any] | None] = {"source": "/dev/ttyUSB0", "baud": 9600}
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake", "commands": ["lamp on", "lamp off"], "safe": "lamp off"}

    def configure(self) -> Sequence[Handler]:
        params, link = self.params, LineLink(self.params.safe_line)
        handlers: list[Handler] = [SerialText(self.label, params, link)]
        if params.commands:
            kind = SerialTextCommands if params.safe is None else SerialTextMotion
            receiver = with_message(kind, _command_of(params.commands), DataChannelReceivable)
            handlers.append(receiver(f"{self.label}_command", link))
        return handlers


def _command_of(lines: tuple[str, ...]) -> type[Message]:
    """The message whose line is one of ``lines``."""
    choices: Any = Literal.__getitem__(lines)
    return create_model("TextCommand", __base__=TextCommand, __module__=__name__, line=(choices, Field()))
