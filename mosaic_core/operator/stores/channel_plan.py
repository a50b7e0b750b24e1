"""Which store and which channels belong to a connector: decided from the catalogue, else from what the caller said.

Pure: no connection needed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches

from mosaic_core.operator.stores.media_store import MediaStreamStore, SoundStore, VoiceStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import BidirectionalStore, ReceivableStore, SendableStore
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.described import DescribedConnector, described_entry
from mosaic_core.words.errors import ConnectionFailed, hint_at
from mosaic_core.words.original_types import CONNECTION_CHECK

UNKNOWN_PATIENCE_S = 30.0
"""For an answer of a connector that does not say how long it may take."""
ON_THE_WAY_S = 5.0
"""What a question and its answer may take on their way, beside the time that the connector gives itself."""


def say_what(data_type: MosaicDataType | None = None) -> str:
    """The cure where nobody knows what travels under a label: for who ``data_type`` is likely for, or for anybody."""
    name = data_type or "DATA-TYPE"
    likely = {
        None: "json-r2u for what it sends, json-u2r for what it takes",
        MosaicDataType.JSON_R2U: "for a camera media",
        MosaicDataType.JSON_U2R: "for a drive --type ros2-receiver-geometry-Twist",
    }
    also = f" ({likely[data_type]})" if data_type in likely else ""
    python = f"RobotConnector(robot_id, label, '{name}')"
    return (
        "Describe the robot on its page in the dashboard, or name the data type: "
        f"in Python {python}, in a terminal --data-type {name}{also}."
    )


@contextmanager
def naming(data_type: MosaicDataType) -> Iterator[None]:
    """Where a label is unknown here, the cure names this data type: that of the direction that was meant."""
    try:
        yield
    except ConnectionFailed as error:
        error.cure = error.cure.replace(say_what(), say_what(data_type))
        raise


@dataclass(frozen=True, slots=True)
class PlannedChannel:
    """A data channel that an operator wants to open. ``resource``: what must be held to command here; ``None`` where
    nothing must. ``may_wait``: a message that waits for a connection, or is repeated on the next one, does no harm;
    never one that moves something. ``schema_id``: what arrives here, as the robot announced it.
    """

    label: str
    delivery: Delivery
    sends: bool
    resource: str | None = None
    may_wait: bool = False
    schema_id: str = ""


@dataclass(frozen=True, slots=True)
class ChannelPlan:
    """The data type and channels of the store that serves one connector. ``channels`` is empty for a camera."""

    data_type: MosaicDataType
    channels: tuple[PlannedChannel, ...]


@dataclass(frozen=True, slots=True)
class Known:
    """The connectors of a robot, as far as they are known. ``is_told``: the robot announces nothing, people wrote it
    down, or nobody did; a caller who names a data type then knows better."""

    catalogue: Catalogue | None
    is_told: bool = False

    def for_connector(self, connector: RobotConnector) -> Catalogue | None:
        """The catalogue to serve ``connector`` by; ``None``: nobody knows anything."""
        wanted, announces = connector.data_type, self.catalogue is not None and not self.is_told
        if wanted is None or announces or self._agrees(connector.connector_id, wanted):
            return self.catalogue
        named = described_entry(DescribedConnector(connector_id=connector.connector_id, data_type=wanted))
        return None if named is None else Catalogue.of([named])

    def _agrees(self, label: str, wanted: MosaicDataType) -> bool:
        """Whether the description has the label, going the same way; only then it knows more than the caller."""
        entry = None if self.catalogue is None else found_entry(self.catalogue, label)
        return entry is not None and wanted in (entry.data_type, *(channel.data_type for channel in entry.channels))


class UnknownLabel(ConnectionFailed):
    """The robot has nothing under this label. ``nearest`` is the most similar one that it has."""

    def __init__(self, label: str, catalogue: Catalogue, *, is_told: bool = False) -> None:
        known = [entry.label for entry in catalogue.entries]
        known += [channel.label for entry in catalogue.entries for channel in entry.channels]
        self.nearest = next(iter(get_close_matches(label, known, 1, 0.5)), None)
        hint = hint_at(label, known)
        has = ", ".join(dict.fromkeys(known)) or "none"
        if is_told:
            message = f"Nobody has described a connector {label!r} of this robot{hint} Described are: {has}."
            cure = f"If the robot has it all the same, say what it is. {say_what()}"
        else:
            message, cure = f"The robot has no connector {label!r}{hint} It has: {has}.", None
        super().__init__(message, code="channel.unknown_label", cure=cure)


def plan_of(connector: RobotConnector, known: Known) -> ChannelPlan:
    """Raises :class:`UnknownLabel`, or :class:`ConnectionFailed` where the data type contradicts the catalogue, or
    nobody knows one."""
    catalogue = known.for_connector(connector)
    if catalogue is None:
        raise nothing_known(connector.connector_id)
    entry = found_entry(catalogue, connector.connector_id)
    if entry is None:
        raise UnknownLabel(connector.connector_id, catalogue, is_told=known.is_told)
    return _checked(connector, _plan_of_entry(entry, connector.connector_id))


def nothing_known(label: str) -> ConnectionFailed:
    """Nobody can tell what travels under ``label``."""
    message = f"Nothing is known about {label!r} yet: name its data type."
    return ConnectionFailed(message, code="channel.unknown_label", cure=say_what())


def changed_labels(before: Catalogue | None, after: Catalogue) -> frozenset[str]:
    """The labels whose channels are others in ``after``: they came, went, or carry something else."""
    old, new = ({one.label: _shape(one) for one in known.entries} if known else {} for known in (before, after))
    return frozenset(label for label in old.keys() | new.keys() if old.get(label) != new.get(label))


def _shape(entry: CatalogueEntry) -> tuple[object, ...]:
    return entry.type, entry.kind, entry.data_type, entry.direction, entry.channels, entry.delivery


def found_entry(catalogue: Catalogue, label: str) -> CatalogueEntry | None:
    """The entry of this label, or the one whose channel has it."""
    whole = next((entry for entry in catalogue.entries if entry.label == label), None)
    parts = (entry for entry in catalogue.entries if any(label == one.label for one in entry.channels))
    return whole or next(parts, None)


def resource_of(entry: CatalogueEntry) -> str | None:
    """The resource that must be held to command this connector; ``None`` where none must."""
    safety = entry.safety or {}
    return str(safety.get("resource") or "motion") if safety.get("requires_lease") else None


def entry_of(catalogue: Catalogue, label: str) -> CatalogueEntry:
    """The connector of this label, or the one whose channel has it; raises :class:`UnknownLabel`."""
    entry = found_entry(catalogue, label)
    if entry is None:
        raise UnknownLabel(label, catalogue)
    return entry


def check_answers(label: str, known: Known) -> None:
    """Refuse a question to a connector that goes one way only, or that describes its messages and no answers, as far
    as the robot announces it. Raises :class:`ConnectionFailed` with the nearest label that answers."""
    if known.catalogue is None or known.is_told:
        return
    entry = found_entry(known.catalogue, label)
    if entry is None:
        return  # told by whoever opens its channel
    is_undescribed = entry.message_schema is None and entry.direction is Direction.BOTH
    if entry.answer_schema is None and not is_undescribed:
        raise _no_answers(label, known.catalogue)


def answer_patience_s(label: str, known: Known) -> float:
    """How long to wait for an answer of this connector, where nobody says: a little longer than it gives itself."""
    entry = None if known.catalogue is None else found_entry(known.catalogue, label)
    within_s = None if entry is None else entry.answer_within_s
    return UNKNOWN_PATIENCE_S if within_s is None else within_s + ON_THE_WAY_S


def answering_entry(label: str, known: Known) -> CatalogueEntry:
    """The entry of a connector that answers requests. Raises :class:`UnknownLabel` and :class:`ConnectionFailed`."""
    if known.catalogue is None:
        raise nothing_known(label)
    entry = entry_of(known.catalogue, label)
    if entry.answer_schema is None:
        raise _no_answers(label, known.catalogue)
    return entry


def _no_answers(label: str, catalogue: Catalogue) -> ConnectionFailed:
    answering = [one.label for one in catalogue.entries if one.answer_schema is not None]
    cure = f"Those that do: {', '.join(answering)}." if answering else "No connector of this robot does."
    message = f"{label!r} answers no requests{hint_at(label, answering)}"
    return ConnectionFailed(message, code="channel.wrong_direction", cure=cure)


def media_labels_of(
    known: Known, stores: Sequence[MosaicStore], named: Sequence[RobotConnector] = ()
) -> tuple[str, ...]:
    """One media line per camera, microphone and loudspeaker of the catalogue, in its order.

    An original robot sends on every line that it is offered, watched or not, and gives its cameras out in the order of
    its file: so all that are described get one, unless the caller ``named`` connectors, and no camera among them.
    """
    entries = known.catalogue.entries if known.catalogue is not None else ()
    labels = tuple(entry.label for entry in entries if entry.data_type is MosaicDataType.MEDIA)
    if not known.is_told:
        return labels
    wanted = [store.robot_connector.connector_id for store in stores if isinstance(store, MediaStreamStore)]
    return () if named and not wanted else tuple(dict.fromkeys((*labels, *wanted)))


def is_connection_check(connector: RobotConnector, catalogue: Catalogue | None) -> bool:
    """Whether the label names a whole ``connection-check`` connector, with both its channels."""
    entries = catalogue.entries if catalogue else ()
    return any(entry.label == connector.connector_id and entry.type == CONNECTION_CHECK for entry in entries)


def make_store(connector: RobotConnector, data_type: MosaicDataType) -> MosaicStore:
    """The store for a data type."""
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


def check_plan_of(connector: RobotConnector, known: Known) -> ChannelPlan:
    """The two channels of a connection check that was asked for by its class; raises :class:`ConnectionFailed` where
    the robot itself says that this label is something else."""
    catalogue = known.for_connector(connector)
    label = connector.connector_id
    if known.is_told and not is_connection_check(connector, catalogue):
        receiver = PlannedChannel(f"{label}-receiver", Delivery.RELIABLE, True)
        sender = PlannedChannel(f"{label}-sender", Delivery.RELIABLE, False)
        return ChannelPlan(MosaicDataType.STRING_U2R, (receiver, sender))
    plan = plan_of(RobotConnector(connector.robot_id, label), known)
    if not is_connection_check(connector, catalogue):
        message = f"{label!r} is no connection-check, so that it can't be timed."
        raise ConnectionFailed(message, code="channel.unknown_label", cure="Name a connector of that type.")
    return plan


def _plan_of_entry(entry: CatalogueEntry, label: str) -> ChannelPlan:
    """Of the whole connector, or of the one channel that is called ``label``."""
    if entry.data_type is MosaicDataType.MEDIA:
        return ChannelPlan(entry.data_type, ())
    if label != entry.label:
        (single,) = (channel for channel in entry.channels if channel.label == label)
        return ChannelPlan(single.data_type, (_planned(entry, single.label, single.data_type),))
    channels = tuple(_planned(entry, channel.label, channel.data_type) for channel in entry.channels)
    return ChannelPlan(entry.data_type, channels or (_planned(entry, entry.label, entry.data_type),))


def _planned(entry: CatalogueEntry, label: str, data_type: MosaicDataType) -> PlannedChannel:
    safety = entry.safety or {}
    is_free = not any(safety.get(key) for key in ("requires_lease", "timeout_s", "max_rate_hz"))
    may_wait = entry.delivery is Delivery.RELIABLE and is_free
    is_first = label == (entry.channels[0].label if entry.channels else entry.label)  # the ids are of its messages
    ids = {MosaicDataType.JSON_R2U: entry.schema_id, MosaicDataType.JSON_BI: entry.sent_schema_id}
    schema_id = ids.get(data_type) if is_first else None
    return PlannedChannel(label, entry.delivery, _sends(data_type), resource_of(entry), may_wait, schema_id or "")


def _sends(data_type: MosaicDataType) -> bool:
    return data_type.direction is not Direction.TO_OPERATOR


def _checked(connector: RobotConnector, plan: ChannelPlan) -> ChannelPlan:
    wanted = connector.data_type
    if wanted is not None and wanted.direction is not plan.data_type.direction:
        message = f"{connector.connector_id!r} is {plan.data_type.value}, not {wanted.value}."
        raise ConnectionFailed(message, code="channel.wrong_direction", cure="Leave the data type to the catalogue.")
    return plan
