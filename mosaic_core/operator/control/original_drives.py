"""Tells what drives an original robot to stand: by zeros, since such a robot has no stop."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable
from dataclasses import dataclass

from mosaic_core.operator.stores.channel_plan import Known
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.operator.stores.stores import SendableStore
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.described import drive_of
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.original_types import DriveCommand

_log = logging.getLogger(__name__)

OPEN_S = 2.0
"""A channel opens within a round trip."""
ORDERLY_END_S = 0.5
"""So long a connection that ends waits for its last zeros; a robot that is not there any more keeps nobody longer."""


@dataclass(frozen=True, slots=True)
class ZerosReport:
    """Which drives of an original robot got their zeros. ``arrived``: labels of drives whose zeros the robot's side has
    acknowledged; ``failed``: those where they have not left, or nobody can tell. Both empty: no drive of this robot is
    known.
    """

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


def command_of(known: Known, label: str) -> DriveCommand | None:
    """How this drive of an original robot is commanded; ``None`` where it is none that is known."""
    return next((command for entry, command in drives_of(known) if entry.label == label), None)


def is_zero(payload: bytes | None, command: DriveCommand) -> bool:
    """Whether this message asks the drive to stand; one that leaves out a number may not."""
    try:
        return payload is not None and bool(json.loads(payload) == command.zero)
    except ValueError:
        return False


async def leave_at_zero(store: SendableStore, command: DriveCommand, timeout_s: float) -> bool:
    """Let a zero be the last message to a drive, and wait until it is acknowledged; ``False``: nobody can tell."""
    try:
        async with asyncio.timeout(timeout_s):
            await store.wait_open(timeout_s)
            is_sent = is_zero(store.last_sent, command) or store.send_json(command.zero)
            store.end()
            return is_sent and await store.wait_arrived(timeout_s)
    except (MosaicError, TimeoutError):
        return False


class CommandedDrives:
    """Remembers which stores of a robot were sent with, and leaves what drives an original robot standing."""

    def __init__(self, stores: StoreManager, robot_id: str) -> None:
        self._stores = stores
        self._robot_id = robot_id
        self._released: dict[str, SendableStore] = {}

    def released(self, store: MosaicStore) -> None:
        """Nobody uses it any more; the drive may go on."""
        if isinstance(store, SendableStore) and store.last_sent is not None:
            self._released[store.robot_connector.connector_id] = store

    async def send_zeros(self, known: Known) -> ZerosReport:
        """Send a zero to each of :func:`drives_of`, and wait until it is acknowledged."""
        drives = drives_of(known)
        done = await asyncio.gather(*(self._send_zero(entry.label, command) for entry, command in drives))
        labels = [entry.label for entry, _ in drives]
        return ZerosReport(
            tuple(label for label, arrived in zip(labels, done, strict=True) if arrived),
            tuple(label for label, arrived in zip(labels, done, strict=True) if not arrived),
        )

    async def leave_standing(self, known: Known, reopen: Callable[[MosaicStore], None]) -> None:
        """The end of a connection: a zero is the last message to every drive among the stores that were used, for which
        those that were released are opened once more. Takes at most :data:`ORDERLY_END_S` and raises nothing."""
        drives = [
            (store, command_of(known, store.robot_connector.connector_id)) for store in self._commanded_stores(reopen)
        ]
        work = [_left_at_zero(store, command) for store, command in drives if command is not None]
        await asyncio.gather(*work, return_exceptions=True)

    def _commanded_stores(self, reopen: Callable[[MosaicStore], None]) -> list[SendableStore]:
        used = [store for store in self._stores.stores_of(self._robot_id) if isinstance(store, SendableStore)]
        live = {store.robot_connector.connector_id: store for store in used}
        again = [store for label, store in self._released.items() if label not in live]
        for store in again:
            reopen(store)
        return [*(store for label, store in live.items() if store.last_sent or label in self._released), *again]

    async def _send_zero(self, label: str, command: DriveCommand) -> bool:
        connector = RobotConnector(self._robot_id, label, MosaicDataType.JSON_U2R)
        store = self._stores.get_or_create_store(connector)
        try:
            if not isinstance(store, SendableStore):
                return False
            await store.wait_open(OPEN_S)
            return store.send_json(command.zero) and await store.wait_arrived()
        except MosaicError:
            return False
        finally:
            self._stores.release_store(connector)


async def _left_at_zero(store: SendableStore, command: DriveCommand) -> None:
    if not await leave_at_zero(store, command, ORDERLY_END_S):
        label = store.robot_connector.connector_id
        _log.warning("the last zero for %r was not acknowledged: the robot may go on", label)
