"""Runs inside the robot: data that nobody needs, as much of it as asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable, Runs
from mosaic_core.contract.params import Params
from mosaic_core.words.data_type import Delivery

BLOCK = bytes(16 * 1024)


class BulkParams(Params):
    rate_mbyteps: float = Field(default=10.0, gt=0, le=100, description="Million bytes per second.")


class BulkSource(DataChannelSendable[bytes]):
    """Sends while somebody listens; what does not fit is lost, the rate stays."""

    runs: ClassVar[Runs] = "watched"
    delivery: ClassVar[Delivery] = Delivery.BULK

    def __init__(self, label: str, params: BulkParams) -> None:
        super().__init__(label)
        self._period_s = len(BLOCK) / (params.rate_mbyteps * 1e6)

    def messages(self) -> Iterator[bytes]:
        sent = 0
        for tick in self.every(max(self._period_s, 0.005)):
            while sent * self._period_s <= tick * max(self._period_s, 0.005):
                sent += 1
                yield BLOCK


class BulkSourceConfigurer(DataChannelConfigurer[BulkParams]):
    connector_type = "bulk-source"

    def configure(self) -> BulkSource:
        return BulkSource(self.label, self.params)
