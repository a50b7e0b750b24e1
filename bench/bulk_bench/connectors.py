"""Runs inside the robot: commands are answered with the time at which they came; bulk flows as fast as it is taken."""

from __future__ import annotations

import time
from typing import Any, ClassVar

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelBidirectional, DataChannelSendable, Runs
from mosaic_core.contract.params import NoParams
from mosaic_core.words.data_type import Delivery

BULK_MESSAGE = bytes(256 * 1024)
FULL_PAUSE_S = 0.005
"""Until a source whose queue is full tries again."""


class Echo(DataChannelBidirectional[dict[str, Any]]):
    """A command comes, telemetry goes."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def handle_data(self, data: dict[str, Any]) -> None:
        self.send_json({"number": data["number"], "came_s": time.monotonic()})


class Flood(DataChannelSendable[bytes]):
    """A source that heeds what it is told: it sends again when there is room."""

    runs: ClassVar[Runs] = "watched"
    delivery: ClassVar[Delivery] = Delivery.BULK

    def messages(self) -> Any:
        while not self.is_stopping:
            if not self.send_bytes(BULK_MESSAGE) and self.pause(FULL_PAUSE_S):
                return
            yield from ()


class EchoConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "command-echo"

    def configure(self) -> Echo:
        return Echo(self.label)


class FloodConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "bulk-flood"

    def configure(self) -> Flood:
        return Flood(self.label)
