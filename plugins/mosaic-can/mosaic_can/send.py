"""The ``can-send`` connector: an operator's values as frames of one message of the DBC file, within its ranges."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from mosaic_can.command_frame import CommandFrame
from mosaic_can.kept_bus import KeptCanBus, shared_bus
from mosaic_can.params import CanBusParams
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.made_message import with_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.limits import MotionKind

SILENCE_S = 0.5
"""Without a command for so long, what moves is told to stand still."""
_MAX_SIGNALS = 64


class CanSendParams(Params):
    bus: CanBusParams = Field(
        default_factory=CanBusParams, description="The bus with its DBC file; the same for all its connectors."
    )
    message: str = Field(description="The message of the DBC file that is sent.")
    kinds: dict[str, MotionKind] = Field(
        default={},
        max_length=_MAX_SIGNALS,
        description="Signals that move something. velocity: 0 stands still; position: it is a place to go to.",
    )
    fixed: dict[str, float | bool | str] = Field(
        default={}, max_length=_MAX_SIGNALS, description="Signals that are the same in every command."
    )
    counter: str | None = Field(default=None, description="A signal that counts the frames.")
    safe: dict[str, float | bool | str] = Field(
        default={},
        max_length=_MAX_SIGNALS,
        description="What the safe frame says beside 0 for each velocity, and what is fixed.",
    )


class CanSend(DataChannelReceivable[Any]):
    """Sends a frame per command; silence, a lost operator and a stop send the safe frame."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    requires_lease = True

    def __init__(self, label: str, frame: CommandFrame, bus: KeptCanBus) -> None:
        super().__init__(label)
        self.timeout_s = SILENCE_S if frame.moves else None
        self.limits = frame.limits()
        self._frame = frame
        self._bus, self.keeper = bus, bus.keeper
        if frame.has_safe:
            bus.begins_and_ends_with(frame.safe)

    def handle_data(self, data: Message) -> None:
        """Receiver's thread."""
        try:
            frame = self._frame.of(data.model_dump())
        except ValueError as error:
            raise Refused("safety.out_of_range", str(error)) from error
        self._bus.send(frame)

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        if self._frame.has_safe:
            self._bus.make_safe(self._frame.safe)


_DRIVE: dict[str, Any] = {
    "message": "DriveCommand",
    "kinds": {"left_mps": "velocity", "right_mps": "velocity"},
    "fixed": {"enabled": True},
    "counter": "counter",
    "safe": {"enabled": False},
}


class CanSendConfigurer(DataChannelConfigurer[CanSendParams]):
    """An operator's values as CAN frames, by a message of a DBC file and within its ranges."""

    connector_type = "can-send"
    example: ClassVar[dict[str, Any] | None] = {"bus": {"channel": "can0", "dbc": "sample"}, **_DRIVE}
    trial: ClassVar[dict[str, Any] | None] = {
        "bus": {"interface": "fake", "channel": "trial", "dbc": "sample"},
        **_DRIVE,
    }

    def configure(self) -> CanSend:
        one, bus = self.params, shared_bus(self.params.bus, self.shared)
        frame = CommandFrame(bus.database.message(one.message), one.kinds, one.fixed, one.safe, one.counter)
        made = with_message(CanSend, frame.message(), DataChannelReceivable)
        return made(self.label, frame, bus)
