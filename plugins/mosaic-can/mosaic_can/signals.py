"""The ``can-signals`` connector: what is said on a bus, by the names and in the units of its DBC file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import can
from cantools.database.can import Message as Described
from pydantic import Field

from mosaic_can.kept_bus import KeptCanBus, shared_bus
from mosaic_can.params import CanBusParams
from mosaic_can.signal_fields import field_names, read_field
from mosaic_can.signal_reader import SignalReader
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.made_message import MadeField, made_message, with_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.data_type import Delivery


class CanSignalsParams(Params):
    bus: CanBusParams = Field(
        default_factory=CanBusParams, description="The bus with its DBC file; the same for all its connectors."
    )
    messages: tuple[str, ...] = Field(
        default=(), max_length=64, description="Messages of the DBC file; default: all of them, and other ids count as "
        "refused.",
    )  # fmt: skip
    rate_hz: float = Field(default=10.0, gt=0, le=100, description="Messages per second, each with the newest values.")
    stale_s: float = Field(default=1.0, gt=0, le=600, description="Values that are older are not told any more.")


class CanSignals(DataChannelSendable[Any]):
    """Sends the newest value of every signal. One that was not heard for ``stale_s`` is null."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(
        self, label: str, params: CanSignalsParams, bus: KeptCanBus, messages: Mapping[str, Described]
    ) -> None:
        super().__init__(label)
        self._params = params
        self._bus = bus
        self._reader = SignalReader(messages, params.stale_s)
        self._listener = bus.listener(self._wants)
        self._refusals = RefusedInput(self)

    def _wants(self, frame: can.Message) -> bool:
        """With names others are not its own; without any, what is unknown is worth to be told."""
        return not self._params.messages or self._reader.knows(frame)

    def messages(self) -> Iterator[Any]:
        for _ in self.every(1 / self._params.rate_hz):
            self._take_in()
            snapshot = self._reader.snapshot(self.monotonic_s())
            self._bus.require()
            if any(value is not None for value in snapshot.values()):
                yield snapshot

    def _take_in(self) -> None:
        frames, dropped = self._listener.take()
        if dropped:
            self.count_loss("dropped", dropped)
        for why in self._reader.feed(frames, self.monotonic_s()):
            self._refusals.add(f"a frame of {self._params.bus.name}", why)


def signals_message(messages: Mapping[str, Described]) -> type[Message]:
    """A field for each message, with a field for each of its signals; all of them may be absent."""
    groups = field_names(messages)
    made: dict[str, MadeField] = {}
    for name, described in messages.items():
        names = field_names(signal.name for signal in described.signals)
        inner = made_message(groups[name], {names[one.name]: read_field(one) for one in described.signals})
        made[groups[name]] = MadeField(inner | None, description=(described.comment or "")[:200], default=None)
    return made_message("CanSignalValues", made)


class CanSignalsConfigurer(DataChannelConfigurer[CanSignalsParams]):
    """What is said on a CAN bus, by the names and in the units of its DBC file."""

    connector_type = "can-signals"
    example: ClassVar[dict[str, Any] | None] = {"bus": {"channel": "can0", "dbc": "sample"}}
    trial: ClassVar[dict[str, Any] | None] = {"bus": {"interface": "fake", "channel": "trial", "dbc": "sample"}}

    def configure(self) -> CanSignals:
        bus = shared_bus(self.params.bus, self.shared)
        messages = bus.database.named(self.params.messages)
        made = with_message(CanSignals, signals_message(messages), DataChannelSendable)
        return made(self.label, self.params, bus, messages)
