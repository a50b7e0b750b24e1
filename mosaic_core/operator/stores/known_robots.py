"""Keeps what the server tells of robots: their status, their short catalogues, and what people wrote down of them."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from mosaic_core.operator.signaling.rest_api import RestApi
from mosaic_core.operator.stores.channel_plan import Known
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.described import DescribedConnector, described_catalogue
from mosaic_core.words.signaling import RobotStatus

_AWAY = (RobotStatus.DISCONNECTED, RobotStatus.WS_CONNECTED)


class KnownRobots:
    """Remembers the newest word on every robot of an account. Event loop only."""

    def __init__(self, rest: RestApi) -> None:
        self.statuses: dict[str, RobotStatus] = {}
        self.catalogues: dict[str, Catalogue] = {}
        self._described: dict[str, Catalogue] = {}
        self._rest = rest
        self._changed = asyncio.Event()

    def known(self, robot_id: str) -> Known:
        """The robot's own catalogue, or what people wrote down."""
        catalogue = self.catalogues.get(robot_id)
        if catalogue is not None:
            return Known(catalogue)
        described = self._described.get(robot_id)
        return Known(described if described is not None and described.entries else None, is_told=True)

    async def look_up(self, robot_id: str, described: Sequence[DescribedConnector], *, has_catalogues: bool) -> None:
        """Ask the server where nothing is known yet; ``described`` counts before what it has."""
        if has_catalogues and robot_id not in self.catalogues:
            catalogue = await self._rest.catalogue(robot_id)
            if catalogue is not None:
                self.catalogues.setdefault(robot_id, catalogue)
        if robot_id not in self.catalogues:
            stored = await self._rest.described(robot_id)
            self._described[robot_id] = described_catalogue((*described, *stored))

    def status_changed(self, robot_id: str, status: RobotStatus) -> bool:
        """Whether it has come back by this."""
        was_away = self.statuses.get(robot_id) in _AWAY
        self.statuses[robot_id] = status
        self._changed.set()
        return was_away and status is RobotStatus.READY_TO_CONNECT

    async def wait_status(self, robot_id: str, status: RobotStatus, timeout_s: float) -> None:
        """Until the robot has this status; raises :class:`TimeoutError`."""
        async with asyncio.timeout(timeout_s):
            while self.statuses.get(robot_id) is not status:
                self._changed.clear()
                await self._changed.wait()
