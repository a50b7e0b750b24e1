"""A device that connectors share, and that its keeper keeps open while the robot runs."""

from __future__ import annotations

from typing import Self

from mosaic_core.contract.devices.keeper import Keeper


class KeptDevice:
    """Lets its ``keeper`` run while it is entered, with the robot (``Shared``): entering never fails and never
    blocks."""

    keeper: Keeper

    def __enter__(self) -> Self:
        self.keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.keeper.stop()
