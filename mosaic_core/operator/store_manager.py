"""Makes stores, counts who uses them, and closes one a second after the last user has let go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar, overload

from mosaic_core.operator.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.mosaic_store import MosaicStore
from mosaic_core.operator.robot_connector import RobotConnector
from mosaic_core.operator.store_plan import Known, found_entry, make_store, plan_of, sound_store
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.original_types import CONNECTION_CHECK

StoreClass = Callable[[RobotConnector], MosaicStore]

S = TypeVar("S", bound=MosaicStore)
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
        known_of: Callable[[str], Known],
        opened: Callable[[MosaicStore], None],
        released: Callable[[MosaicStore], None],
    ) -> None:
        self._known_of = known_of
        self._opened = opened
        self._released = released
        self._classes: dict[str, StoreClass] = {CONNECTION_CHECK: ConnectionCheckingStore}
        self._stores: dict[tuple[str, str], _Counted] = {}

    def register(self, connector_type: str, store_class: StoreClass) -> None:
        """From now on, connectors of this type (in the YAML file) have stores of this class, one's own."""
        self._classes[connector_type] = store_class

    @overload
    def get_or_create_store(self, robot_connector: RobotConnector) -> MosaicStore: ...
    @overload
    def get_or_create_store(self, robot_connector: RobotConnector, store_class: type[S]) -> S: ...
    def get_or_create_store(
        self, robot_connector: RobotConnector, store_class: type[MosaicStore] | None = None
    ) -> MosaicStore:
        """The store of this connector; the same one for every caller until all have released it.

        Its class follows from the connector's type, else from its data type, unless ``store_class`` asks for one: that
        needs to know neither yet. Raises :class:`ConnectionFailed` (``channel.unknown_label``) naming the nearest
        label, if the robot's catalogue is known and holds no such label, if nothing tells the data type, or if the
        store is of another class already.
        """
        counted = self._stores.get(robot_connector.key)
        if counted is None:
            store = store_class(robot_connector) if store_class is not None else self._made(robot_connector)
            counted = self._stores[robot_connector.key] = _Counted(store, users=1)
            self._opened(store)
            return store
        if store_class is not None and not isinstance(counted.store, store_class):
            has, label = type(counted.store).__name__, robot_connector.connector_id
            message = f"{label!r} has a {has} already, no {store_class.__name__}."
            raise ConnectionFailed(message, code="channel.unknown_label", cure="Release that store first.")
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
        known = self._known_of(connector.robot_id)
        plan = plan_of(connector, known)
        catalogue = known.for_connector(connector)
        named = RobotConnector(connector.robot_id, connector.connector_id, plan.data_type)
        entry = None if catalogue is None else found_entry(catalogue, connector.connector_id)
        if entry is not None and entry.label == connector.connector_id and entry.type in self._classes:
            return self._classes[entry.type](named)
        sound = None if catalogue is None else sound_store(named, catalogue)
        return sound or make_store(named, plan.data_type)

    def _forget(self, key: tuple[str, str]) -> None:
        counted = self._stores.pop(key)
        if counted.lingering is not None:
            counted.lingering.cancel()
        self._released(counted.store)
