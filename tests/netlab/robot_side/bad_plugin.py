"""Runs inside the robot: a connector that does what no plugin may, it blocks the event loop."""

from __future__ import annotations

import time

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelStringReceivable
from mosaic_core.contract.params import NoParams


class Blocker(DataChannelStringReceivable):
    """Told how many seconds, it sleeps that long on the loop that everything else needs."""

    async def handle_data(self, data: str) -> None:
        time.sleep(float(data))  # noqa: ASYNC251 (the mistake that the test is about)


class BlockerConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "blocker"

    def configure(self) -> Blocker:
        return Blocker(self.label)
