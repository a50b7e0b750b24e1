"""Gives the stores of one robot by label, each of the class that a program wants to use."""

from __future__ import annotations

from typing import TypeVar

from mosaic_core.operator.stores.channel_plan import naming
from mosaic_core.operator.stores.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.stores.media_store import MediaStreamStore, SoundStore, VoiceStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.operator.stores.stores import BidirectionalStore, ReceivableStore, SendableStore
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed

S = TypeVar("S", bound=MosaicStore)


class RobotStores:
    """Makes or finds a store, and raises :class:`ConnectionFailed` where the connector is of another kind."""

    def __init__(self, stores: StoreManager, robot_id: str) -> None:
        self.robot_id = robot_id
        self._stores = stores

    def receivable(self, label: str, data_type: MosaicDataType | str | None = None) -> ReceivableStore:
        """The store of a robot → operator connector; ``data_type``, also as text, only for original robots."""
        return self._store(label, data_type, ReceivableStore)

    def sendable(self, label: str, data_type: MosaicDataType | str | None = None) -> SendableStore:
        """The store of an operator → robot connector."""
        return self._store(label, data_type, SendableStore)

    def bidirectional(self, label: str) -> BidirectionalStore:
        return self._store(label, MosaicDataType.JSON_BI, BidirectionalStore)

    def media(self, label: str) -> MediaStreamStore:
        """The store of a camera."""
        return self._store(label, MosaicDataType.MEDIA, MediaStreamStore)

    def microphone(self, label: str) -> SoundStore:
        """The store of what a robot's microphone hears."""
        return self._store(label, MosaicDataType.MEDIA, SoundStore)

    def speaker(self, label: str) -> VoiceStore:
        """The store of one's own voice for a robot's loudspeaker."""
        return self._store(label, MosaicDataType.MEDIA, VoiceStore)

    def connection_check(self, label: str) -> ConnectionCheckingStore:
        """The store that times the round trip over a ``connection-check``, of whatever robot."""
        return self._stores.get_or_create_store(RobotConnector(self.robot_id, label), ConnectionCheckingStore)

    def _store(self, label: str, data_type: MosaicDataType | str | None, kind: type[S]) -> S:
        connector = RobotConnector(self.robot_id, label, data_type)
        with naming(MosaicDataType.JSON_U2R if issubclass(kind, SendableStore) else MosaicDataType.JSON_R2U):
            store = self._stores.get_or_create_store(connector)
        if isinstance(store, kind):
            return store
        self._stores.release_store(connector)
        message = f"{label!r} has a {type(store).__name__}, not a {kind.__name__}."
        raise ConnectionFailed(message, code="channel.unknown_label", cure="")
