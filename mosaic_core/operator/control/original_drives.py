"""Tells what drives an original robot to stand: by zeros, since such a robot has no stop."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from mosaic_core.operator.stores.channel_plan import Known
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.operator.stores.stores import SendableStore
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.described import drive_of
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.original_types import DriveCommand

OPEN_S = 2.0
"""A channel opens within a round trip."""


@dataclass(frozen=True, slots=True)
class ZerosReport:
    """``arrived``: labels of drives whose zeros the robot's side has acknowledged; ``failed``: those where they have
    not left, or nobody can tell. Both empty: no drive of this robot is known."""

    arrived: tuple[str, ...] = ()
    failed: tuple[str, ...] = ()

    @property
    def is_complete(self) -> bool:
        """Every drive that is known was reached, and there is one."""
        return bool(self.arrived) and not self.failed


def drives_of(known: Known) -> list[tuple[CatalogueEntry, DriveCommand]]:
    """What is known to drive an original robot, and how it is commanded; nothing of ours, which has a stop."""
    entries = known.catalogue.entries if known.is_told and known.catalogue is not None else ()
    return [(entry, command) for entry in entries if (command := drive_of(entry)) is not None]


async def send_zeros(stores: StoreManager, robot_id: str, known: Known) -> ZerosReport:
    """Send a zero to each of :func:`drives_of`, and wait until it is acknowledged."""
    drives = drives_of(known)
    done = await asyncio.gather(*(_send_zero(stores, robot_id, entry.label, command) for entry, command in drives))
    labels = [entry.label for entry, _ in drives]
    return ZerosReport(
        tuple(label for label, arrived in zip(labels, done, strict=True) if arrived),
        tuple(label for label, arrived in zip(labels, done, strict=True) if not arrived),
    )


async def _send_zero(stores: StoreManager, robot_id: str, label: str, command: DriveCommand) -> bool:
    connector = RobotConnector(robot_id, label, MosaicDataType.JSON_U2R)
    store = stores.get_or_create_store(connector)
    try:
        if not isinstance(store, SendableStore):
            return False
        await store.wait_open(OPEN_S)
        return store.send_json(command.zero) and await store.wait_arrived()
    except MosaicError:
        return False
    finally:
        stores.release_store(connector)
