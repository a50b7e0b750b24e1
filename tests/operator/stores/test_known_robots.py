"""An operator knows of a robot what the server told last, and asks it only for what is missing."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.operator.stores.known_robots import KnownRobots
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.described import DescribedConnector
from mosaic_core.words.signaling import RobotStatus

BATTERY = CatalogueEntry(
    label="battery", type="battery", data_type=MosaicDataType.JSON_R2U, direction=Direction.TO_OPERATOR
)
OWN = Catalogue.of([BATTERY])
STORED = DescribedConnector(connector_id="pose", data_type=MosaicDataType.JSON_R2U)
NAMED = DescribedConnector(connector_id="pose", data_type=MosaicDataType.STRING_R2U)


class Rest:
    """A server that has this catalogue and this description, and counts who asks for them."""

    def __init__(self, catalogue: Catalogue | None = None, *described: DescribedConnector) -> None:
        self._catalogue = catalogue
        self._described = described
        self.asked: list[str] = []

    async def catalogue(self, robot_id: str) -> Catalogue | None:
        self.asked.append("catalogue")
        return self._catalogue

    async def described(self, robot_id: str) -> tuple[DescribedConnector, ...]:
        self.asked.append("described")
        return self._described


def robots_of(rest: Any) -> KnownRobots:
    return KnownRobots(rest)


async def test_the_robots_own_catalogue_is_asked_for_once() -> None:
    rest = Rest(OWN, STORED)
    robots = robots_of(rest)
    for _ in range(2):
        await robots.look_up("r", (), has_catalogues=True)
    assert rest.asked == ["catalogue"]
    assert robots.known("r").catalogue == OWN
    assert not robots.known("r").is_told


async def test_where_the_robot_announces_nothing_its_description_counts_and_the_callers_before_it() -> None:
    robots = robots_of(Rest(None, STORED))
    await robots.look_up("r", (NAMED,), has_catalogues=True)
    known = robots.known("r")
    assert known.is_told
    assert known.catalogue is not None
    assert [entry.data_type for entry in known.catalogue.entries] == [MosaicDataType.STRING_R2U]


async def test_a_server_without_catalogues_is_not_asked_for_one() -> None:
    rest = Rest(OWN)
    robots = robots_of(rest)
    await robots.look_up("r", (), has_catalogues=False)
    assert rest.asked == ["described"]
    assert robots.known("r").catalogue is None
    assert robots.known("r").is_told


@pytest.mark.parametrize(
    ("before", "after", "has_returned"),
    [
        (None, RobotStatus.READY_TO_CONNECT, False),
        (RobotStatus.DISCONNECTED, RobotStatus.READY_TO_CONNECT, True),
        (RobotStatus.WS_CONNECTED, RobotStatus.READY_TO_CONNECT, True),
        (RobotStatus.DISCONNECTED, RobotStatus.WS_CONNECTED, False),
        (RobotStatus.RTC_CONNECTED, RobotStatus.READY_TO_CONNECT, False),
    ],
)
async def test_a_robot_returns_when_it_was_away_and_is_ready(
    before: RobotStatus | None, after: RobotStatus, has_returned: bool
) -> None:
    robots = robots_of(Rest())
    if before is not None:
        robots.status_changed("r", before)
    assert robots.status_changed("r", after) is has_returned
    assert robots.statuses == {"r": after}


async def test_a_status_is_waited_for_and_that_of_another_robot_is_not_it() -> None:
    robots = robots_of(Rest())
    waiting = asyncio.create_task(robots.wait_status("r", RobotStatus.READY_TO_CONNECT, 5.0))
    await asyncio.sleep(0)
    robots.status_changed("other", RobotStatus.READY_TO_CONNECT)
    await asyncio.sleep(0)
    assert not waiting.done()
    robots.status_changed("r", RobotStatus.READY_TO_CONNECT)
    await waiting
