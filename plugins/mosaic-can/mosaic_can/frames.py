"""The ``can-frames`` connector: the frames of a bus as they are, as many a second as the link shall carry."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import can
from pydantic import Field

from mosaic_can.kept_bus import KeptCanBus, shared_bus
from mosaic_can.params import CanBusParams, CanFilter
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Message, Params
from mosaic_core.machines.timing.pacing import TokenBucket

WAIT_S = 0.1


class CanFramesParams(Params):
    bus: CanBusParams = Field(default_factory=CanBusParams, description="The bus; the same for all its connectors.")
    filters: tuple[CanFilter, ...] = Field(
        default=(), max_length=64, description="Frames that are taken; default: all of them."
    )
    max_rate_hz: float = Field(
        default=100.0, gt=0, le=2000, description="Frames per second; what comes faster is left out, and counted."
    )


class CanFrame(Message):
    """One frame as it was on the bus."""

    id: int = Field(ge=0, description="Its identifier, of 11 or 29 bits.")
    is_extended: bool = Field(description="Whether the identifier has 29 bits.")
    data: str = Field(description="Its bytes in hexadecimal, two digits each.")
    is_remote: bool = Field(default=False, description="Whether it asks for a frame instead of bringing data.")


class CanFrames(DataChannelSendable[CanFrame]):
    """Sends frames in the order in which they came."""

    def __init__(self, label: str, params: CanFramesParams, bus: KeptCanBus) -> None:
        super().__init__(label)
        self._params = params
        self._bus = bus
        self._listener = bus.listener(self._wants)

    def _wants(self, frame: can.Message) -> bool:
        filters = self._params.filters
        return not filters or any(one.takes(frame.arbitration_id, is_extended=frame.is_extended_id) for one in filters)

    def messages(self) -> Iterator[CanFrame]:
        bucket = TokenBucket.of_rate(self._params.max_rate_hz)
        while not self.is_stopping:
            frames, dropped = self._listener.take(WAIT_S)
            if dropped:
                self.count_loss("dropped", dropped)
            for frame in frames:
                if bucket.admits(self.monotonic_s()):
                    yield _message_of(frame)
                else:
                    self.count_loss("thinned")
            self._bus.require()


def _message_of(frame: can.Message) -> CanFrame:
    return CanFrame(
        id=frame.arbitration_id,
        is_extended=frame.is_extended_id,
        data=frame.data.hex(),
        is_remote=frame.is_remote_frame,
    )


class CanFramesConfigurer(DataChannelConfigurer[CanFramesParams]):
    """The frames of a CAN bus as they are, filtered by their ids."""

    connector_type = "can-frames"
    example: ClassVar[dict[str, Any] | None] = {"bus": {"channel": "can0"}, "filters": [{"id": 513}]}
    trial: ClassVar[dict[str, Any] | None] = {"bus": {"interface": "fake", "channel": "trial"}}

    def configure(self) -> CanFrames:
        return CanFrames(self.label, self.params, shared_bus(self.params.bus, self.shared))
