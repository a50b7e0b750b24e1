"""Makes stores, counts who uses them, and closes one a second after the last user has let go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mosaic_core.operator.mosaic_store import MosaicStore
from mosaic_core.operator.robot_connector import RobotConnector
from mosaic_core.operator.store_plan import is_connection_check, make_store, plan_of, sound_store
from mosaic_core.words.catalogue import Catalogue

LINGER_S = 1.0
"""A page that is left and entered again must not close and open its channel: original robots ignore a label that is
still open."""


@dataclass(slots=True)
class _Counted:
    store: MosaicStore
    users: int = 0
    lingering: asyncio.TimerHandle | None = None


class StoreManager:
    """One per operator, for all its robots. ``opened(store)`` and ``released(store)`` are told to the connection."""

    def __init__(
        self,
        catalogue_of: Callable[[str], Catalogue | None],
        opened: Callable[[MosaicStore], None],
        released: Callable[[MosaicStore], None],
    ) -> None:
        self._catalogue_of = catalogue_of
        self._opened = opened
        self._released = released
        self._stores: dict[tuple[str, str], _Counted] = {}

    def get_or_create_store(self, robot_connector: RobotConnector) -> MosaicStore:
        """The store of this connector; the same one for every caller until all have released it.

        Raises :class:`ConnectionFailed` (``channel.unknown_label``) naming the nearest label, if the robot's catalogue
        is known and holds no such label, or if nothing tells the data type.
        """
        counted = self._stores.get(robot_connector.key)
        if counted is None:
            counted = self._stores[robot_connector.key] = _Counted(self._made(robot_connector))
            counted.users = 1
            self._opened(counted.store)
            return counted.store
        if counted.lingering is not None:
            counted.lingering.cancel()
            counted.lingering = None
        counted.users += 1
        return counted.store

    def adopt(self, store: MosaicStore) -> MosaicStore:
        """Use a store of one's own class under its connector; the caller counts as its first user."""
        counted = self._stores.get(store.robot_connector.key)
        if counted is not None:
            raise ValueError(f"{store.robot_connector.connector_id!r} has a store already")
        self._stores[store.robot_connector.key] = _Counted(store, users=1)
        self._opened(store)
        return store

    def release_store(self, robot_connector: RobotConnector) -> None:
        """Let go of it once; the last one closes its channel :data:`LINGER_S` later."""
        counted = self._stores.get(robot_connector.key)
        if counted is None or counted.users == 0:
            return
        counted.users -= 1
        if counted.users == 0:
            loop = asyncio.get_running_loop()
            counted.lingering = loop.call_later(LINGER_S, self._forget, robot_connector.key)

    def stores_of(self, robot_id: str) -> Sequence[MosaicStore]:
        """All stores of one robot, in the order of their making."""
        return [counted.store for key, counted in self._stores.items() if key[0] == robot_id]

    def close(self) -> None:
        """Forget everything at once."""
        for key in list(self._stores):
            self._forget(key)

    def _made(self, connector: RobotConnector) -> MosaicStore:
        catalogue = self._catalogue_of(connector.robot_id)
        if catalogue is None:
            return make_store(connector, connector.data_type)
        plan = plan_of(connector, catalogue)
        named = RobotConnector(connector.robot_id, connector.connector_id, plan.data_type)
        heard = sound_store(named, catalogue)
        if heard is not None:
            return heard
        return make_store(named, plan.data_type, checks=is_connection_check(connector, catalogue))

    def _forget(self, key: tuple[str, str]) -> None:
        counted = self._stores.pop(key)
        if counted.lingering is not None:
            counted.lingering.cancel()
        self._released(counted.store)
