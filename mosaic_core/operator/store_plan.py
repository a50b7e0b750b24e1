"""Which store and which channels belong to a connector: decided from the catalogue, else from what the caller said.

Pure: no connection needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from mosaic_core.operator.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.media_store import MediaStreamStore
from mosaic_core.operator.mosaic_store import MosaicStore
from mosaic_core.operator.robot_connector import RobotConnector
from mosaic_core.operator.sound_stores import SoundStore, VoiceStore
from mosaic_core.operator.stores import BidirectionalStore, ReceivableStore, SendableStore
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConnectionFailed

CONNECTION_CHECK = "connection-check"


@dataclass(frozen=True, slots=True)
class PlannedChannel:
    """``resource``: what must be held to command here; ``None`` where nothing must. ``may_wait``: a message that waits
    for a connection, or is repeated on the next one, does no harm; never one that moves something."""

    label: str
    delivery: Delivery
    sends: bool
    resource: str | None = None
    may_wait: bool = False


@dataclass(frozen=True, slots=True)
class StorePlan:
    """How to serve one connector. ``channels`` is empty for a camera."""

    data_type: MosaicDataType
    channels: tuple[PlannedChannel, ...]

    @property
    def is_media(self) -> bool:
        return self.data_type is MosaicDataType.MEDIA


class UnknownLabel(ConnectionFailed):
    """The robot has nothing under this label. ``nearest`` is the most similar one that it has."""

    def __init__(self, label: str, catalogue: Catalogue) -> None:
        known = [entry.label for entry in catalogue.entries]
        known += [channel.label for entry in catalogue.entries for channel in entry.channels]
        self.nearest = next(iter(get_close_matches(label, known, 1, 0.5)), None)
        hint = f"; did you mean {self.nearest!r}?" if self.nearest else ""
        has = ", ".join(dict.fromkeys(known)) or "none"
        super().__init__(f"The robot has no connector {label!r}{hint} It has: {has}.", code="channel.unknown_label")


def plan_of(connector: RobotConnector, catalogue: Catalogue | None) -> StorePlan:
    """Raises :class:`UnknownLabel`, or :class:`ConnectionFailed` where the data type contradicts the catalogue."""
    if catalogue is None:
        return _plan_without_catalogue(connector)
    for entry in catalogue.entries:
        if entry.label == connector.connector_id:
            return _checked(connector, _plan_of_entry(entry))
        for channel in entry.channels:
            if channel.label == connector.connector_id:
                single = _planned(entry, channel.label, channel.data_type)
                return _checked(connector, StorePlan(channel.data_type, (single,)))
    raise UnknownLabel(connector.connector_id, catalogue)


def resource_of(entry: CatalogueEntry) -> str | None:
    """The resource that must be held to command this connector; ``None`` where none must."""
    safety = entry.safety or {}
    return str(safety.get("resource") or "motion") if safety.get("requires_lease") else None


def entry_of(catalogue: Catalogue, label: str) -> CatalogueEntry:
    """The connector of this label, or the one whose channel has it; raises :class:`UnknownLabel`."""
    for entry in catalogue.entries:
        if label == entry.label or any(label == channel.label for channel in entry.channels):
            return entry
    raise UnknownLabel(label, catalogue)


def media_labels_of(catalogue: Catalogue | None, stores: Sequence[MosaicStore]) -> tuple[str, ...]:
    """One media line per camera, microphone and loudspeaker of the catalogue, in its order; without a catalogue, for
    the stores that exist."""
    if catalogue is not None:
        return tuple(entry.label for entry in catalogue.entries if entry.data_type is MosaicDataType.MEDIA)
    return tuple(store.robot_connector.connector_id for store in stores if isinstance(store, MediaStreamStore))


def is_connection_check(connector: RobotConnector, catalogue: Catalogue | None) -> bool:
    """Whether the label names a whole ``connection-check`` connector, with both its channels."""
    entries = catalogue.entries if catalogue else ()
    return any(entry.label == connector.connector_id and entry.type == CONNECTION_CHECK for entry in entries)


def make_store(connector: RobotConnector, data_type: MosaicDataType | None, *, checks: bool = False) -> MosaicStore:
    """The store for a data type; raises :class:`ConnectionFailed` if nobody knows one."""
    if checks:
        return ConnectionCheckingStore(connector)
    if data_type is None:
        label = connector.connector_id
        message = f"Nothing is known about {label!r} yet: connect first, or name its data type in RobotConnector."
        raise ConnectionFailed(message, code="channel.unknown_label", cure="")
    if data_type is MosaicDataType.MEDIA:
        return MediaStreamStore(connector)
    kinds: dict[Direction, type[MosaicStore]] = {
        Direction.BOTH: BidirectionalStore,
        Direction.TO_ROBOT: SendableStore,
        Direction.TO_OPERATOR: ReceivableStore,
    }
    return kinds[data_type.direction](connector)


def sound_store(connector: RobotConnector, catalogue: Catalogue) -> SoundStore | VoiceStore | None:
    """The store of a microphone or loudspeaker; ``None`` for anything else."""
    for entry in catalogue.entries:
        if entry.label == connector.connector_id and entry.kind is Kind.AUDIO:
            return VoiceStore(connector) if entry.direction is Direction.TO_ROBOT else SoundStore(connector)
    return None


def check_plan(label: str) -> StorePlan:
    """The two channels of a ``connection-check`` on a robot without a catalogue."""
    channels = (
        PlannedChannel(f"{label}-receiver", Delivery.RELIABLE, True),
        PlannedChannel(f"{label}-sender", Delivery.RELIABLE, False),
    )
    return StorePlan(MosaicDataType.STRING_U2R, channels)


def _plan_of_entry(entry: CatalogueEntry) -> StorePlan:
    if entry.data_type is MosaicDataType.MEDIA:
        return StorePlan(entry.data_type, ())
    channels = tuple(_planned(entry, channel.label, channel.data_type) for channel in entry.channels)
    return StorePlan(entry.data_type, channels or (_planned(entry, entry.label, entry.data_type),))


def _planned(entry: CatalogueEntry, label: str, data_type: MosaicDataType) -> PlannedChannel:
    safety = entry.safety or {}
    is_free = not any(safety.get(key) for key in ("requires_lease", "timeout_s", "max_rate_hz"))
    may_wait = entry.delivery is Delivery.RELIABLE and is_free
    return PlannedChannel(label, entry.delivery, _sends(data_type), resource_of(entry), may_wait)


def _plan_without_catalogue(connector: RobotConnector) -> StorePlan:
    data_type = connector.data_type
    if data_type is None:
        make_store(connector, None)
    assert data_type is not None
    if data_type is MosaicDataType.MEDIA:
        return StorePlan(data_type, ())
    return StorePlan(data_type, (PlannedChannel(connector.connector_id, Delivery.RELIABLE, _sends(data_type)),))


def _sends(data_type: MosaicDataType) -> bool:
    return data_type.direction is not Direction.TO_OPERATOR


def _checked(connector: RobotConnector, plan: StorePlan) -> StorePlan:
    wanted = connector.data_type
    if wanted is not None and wanted.direction is not plan.data_type.direction:
        message = f"{connector.connector_id!r} is {plan.data_type.value}, not {wanted.value}."
        raise ConnectionFailed(message, code="channel.unknown_label", cure="Leave the data type to the catalogue.")
    return plan
