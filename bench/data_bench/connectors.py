"""Runs inside the robot: three sources that never ask whether the link can take it."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from typing import ClassVar

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import NoParams
from mosaic_core.words.data_type import Delivery

STAMP = struct.Struct("!d")
"""The monotonic clock, which all processes of a machine share."""


class Source(DataChannelSendable[bytes]):
    size_bytes: ClassVar[int]
    period_s: ClassVar[float]

    def messages(self) -> Iterator[bytes]:
        filling = bytes(self.size_bytes - STAMP.size)
        for _ in self.every(self.period_s):
            yield STAMP.pack(time.monotonic()) + filling


class Newest(Source):
    """13 Mbit/s of values of which only the last counts."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    size_bytes: ClassVar[int] = 8 * 1024
    period_s: ClassVar[float] = 0.005


class Events(Source):
    """8 Mbit/s that shall all arrive."""

    delivery: ClassVar[Delivery] = Delivery.RELIABLE
    size_bytes: ClassVar[int] = 2 * 1024
    period_s: ClassVar[float] = 0.002


class Maps(Source):
    """42 Mbit/s behind everything else."""

    delivery: ClassVar[Delivery] = Delivery.BULK
    size_bytes: ClassVar[int] = 512 * 1024
    period_s: ClassVar[float] = 0.1


class NewestConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "newest"

    def configure(self) -> Newest:
        return Newest(self.label)


class EventsConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "events"

    def configure(self) -> Events:
        return Events(self.label)


class MapsConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "maps"

    def configure(self) -> Maps:
        return Maps(self.label)
