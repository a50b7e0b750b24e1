"""Makes stores, counts who uses them, and closes one a second after the last user has let go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar, overload

from mosaic_core.operator.stores.channel_plan import Known, found_entry, make_store, plan_of, sound_store
from mosaic_core.operator.stores.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.original_types import CONNECTION_CHECK

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
    """Keeps the stores of one operator, for all its robots. ``opened(store)`` and ``released(store)`` are told to the
    connection."""

    def __init__(
        self,
        known_of: Callable[[str], Known],
        opened: Callable[[MosaicStore], None],
        released: Callable[[MosaicStore], None],
    ) -> None:
        self._known_of = known_of
        self._opened = opened
        self._released = released
        self._classes: dict[tuple[str, str], type[MosaicStore]] = {("type", CONNECTION_CHECK): ConnectionCheckingStore}
        self._stores: dict[tuple[str, str], _Counted] = {}

    def register_mosaic_store(
        self,
        store_class: type[MosaicStore],
        *,
        label: str = "",
        connector_type: str = "",
        data_type: MosaicDataType | str | None = None,
    ) -> None:
        """From now on, connectors with this label, this type (in the YAML file) or this data type have stores of this
        class. A label counts more than a type, that more than a data type; of two alike the newer counts. Without any
        of them the class says it itself, as ``data_type = MosaicDataType.JSON_R2U``."""
        told = data_type or ("" if label or connector_type else getattr(store_class, "data_type", ""))
        matches = {"label": label, "type": connector_type, "data_type": MosaicDataType.named(told) if told else ""}
        if not any(matches.values()):
            raise TypeError(
                f"{store_class.__name__} has no data_type: say for which connectors it is, as label='battery'"
            )
        self._classes.update({(kind, name): store_class for kind, name in matches.items() if name})

    @overload
    def get_or_create_store(self, robot_connector: RobotConnector) -> MosaicStore: ...
    @overload
    def get_or_create_store(self, robot_connector: RobotConnector, store_class: type[S]) -> S: ...
    def get_or_create_store(
        self, robot_connector: RobotConnector, store_class: type[MosaicStore] | None = None
    ) -> MosaicStore:
        """The store of this connector; the same one for every caller until all have released it.

        Its class is the one registered for it, or else follows from its type and data type; ``store_class`` asks for
        one, and then neither needs to be known yet. Raises :class:`ConnectionFailed` (``channel.unknown_label``)
        naming the nearest label, if the robot's catalogue is known and holds no such label, if nothing tells the data
        type, or if somebody uses a store of another class there.
        """
        counted = self._stores.get(robot_connector.key)
        if counted is not None and store_class is not None and not isinstance(counted.store, store_class):
            self._make_room(counted, store_class)
            counted = None
        if counted is None:
            store = self._made(robot_connector, store_class)
            counted = self._stores[robot_connector.key] = _Counted(store, users=1)
            self._opened(store)
            return store
        if counted.lingering is not None:
            counted.lingering.cancel()
            counted.lingering = None
        counted.users += 1
        return counted.store

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

    def _make_room(self, counted: _Counted, wanted: type[MosaicStore]) -> None:
        """A store of another class goes if it only lingers; raises :class:`ConnectionFailed` while somebody uses it."""
        connector = counted.store.robot_connector
        if counted.users:
            message = f"{connector.connector_id!r} has a {type(counted.store).__name__} already, no {wanted.__name__}."
            raise ConnectionFailed(message, code="channel.unknown_label", cure="Release that store first.")
        self._forget(connector.key)

    def _made(self, connector: RobotConnector, wanted: type[MosaicStore] | None) -> MosaicStore:
        """A store of the class that was asked for, or registered, or fits; a registered one may refine the former."""
        known = self._known_of(connector.robot_id)
        catalogue = known.for_connector(connector)
        entry = None if catalogue is None else found_entry(catalogue, connector.connector_id)
        if wanted is not None:
            registered = self._registered(connector, connector.data_type, entry)
            is_finer = registered is not None and issubclass(registered, wanted)
            return registered(connector) if registered is not None and is_finer else wanted(connector)
        plan = plan_of(connector, known)
        named = RobotConnector(connector.robot_id, connector.connector_id, plan.data_type)
        registered = self._registered(connector, plan.data_type, entry)
        if registered is not None:
            return registered(named)
        sound = None if catalogue is None else sound_store(named, catalogue)
        return sound or make_store(named, plan.data_type)

    def _registered(
        self, connector: RobotConnector, data_type: MosaicDataType | None, entry: CatalogueEntry | None
    ) -> type[MosaicStore] | None:
        is_whole = entry is not None and entry.label == connector.connector_id
        by_type = entry.type if entry is not None and is_whole else ""
        keys = (("label", connector.connector_id), ("type", by_type), ("data_type", str(data_type or "")))
        return next((self._classes[key] for key in keys if key in self._classes), None)

    def _forget(self, key: tuple[str, str]) -> None:
        counted = self._stores.pop(key)
        if counted.lingering is not None:
            counted.lingering.cancel()
        self._released(counted.store)
