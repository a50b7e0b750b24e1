"""The catalogue of a robot that announces none, from what people wrote down of its connectors.

On the server this is ``connectorConfig``, as the original dashboard keeps it; ``dataType`` and ``widget`` are ours, for
types that :data:`ORIGINAL_TYPES` does not hold.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from pydantic import Field, ValidationError

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry, ChannelEntry
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_core.words.original_types import (
    CONNECTION_CHECK,
    ORIGINAL_DRIVES,
    ORIGINAL_TYPES,
    DriveCommand,
    OriginalType,
)
from mosaic_core.words.wire_model import WireModel

MOST_CHANNELS = 64
"""More channels for one point cloud no robot has; a slip of the keyboard must not open a thousand."""
_PARALLEL_WORDS = ("parallelNum", "parallel_num", "parallel_stream")


class DescribedConnector(WireModel):
    """One connector as somebody wrote it down: a type of ``ORIGINAL_TYPES``, or any other beside its data type."""

    connector_id: str = Field(min_length=1)
    connector_type: str = ""
    params: dict[str, Any] | None = None
    data_type: MosaicDataType | None = None
    widget: str | None = None

    @property
    def parallel_num(self) -> int:
        """How many numbered channels it says it has; 0 where it does not say so."""
        for word in _PARALLEL_WORDS:
            text = str((self.params or {}).get(word, "")).strip()
            if text.isdecimal():
                return min(int(text), MOST_CHANNELS)
        return 0


def read_connector_config(text: str | None) -> tuple[DescribedConnector, ...]:
    """What a ``connectorConfig`` holds; entries that nobody can read are left out, as original dashboards do."""
    try:
        rows = json.loads(text or "{}")["connectors"]
    except (ValueError, TypeError, LookupError):
        return ()
    found: list[DescribedConnector] = []
    for row in rows if isinstance(rows, list) else ():
        try:
            found.append(DescribedConnector.model_validate(row))
        except ValidationError:
            continue
    return tuple(found)


def described_catalogue(connectors: Iterable[DescribedConnector]) -> Catalogue:
    """The catalogue that the robot would announce if it could; what has no known data type is not in it."""
    entries: dict[str, CatalogueEntry] = {}
    for connector in connectors:
        entry = described_entry(connector)
        if entry is not None:
            entries.setdefault(entry.label, entry)
    return Catalogue.of(entries.values())


def described_entry(connector: DescribedConnector) -> CatalogueEntry | None:
    """One of them; ``None`` where neither the table nor ``data_type`` tells what travels there."""
    known = ORIGINAL_TYPES.get(connector.connector_type)
    if known is not None and known.half is not None:
        whole, half = ORIGINAL_TYPES[CONNECTION_CHECK], known.half
        if connector.connector_id.endswith(half) and connector.connector_id != half:
            return _entry(connector.connector_id.removesuffix(half), whole.type, connector, whole)
    if known is None and connector.data_type is None:
        return None
    return _entry(connector.connector_id, connector.connector_type, connector, known)


def drive_of(entry: CatalogueEntry) -> DriveCommand | None:
    """How to command this connector of an original robot; ``None`` where it drives nothing that we know of."""
    if entry.data_type is not MosaicDataType.JSON_U2R:
        return None
    known = ORIGINAL_TYPES.get(entry.type)
    if known is not None and known.drive is not None:
        return ORIGINAL_DRIVES[known.drive]
    return ORIGINAL_DRIVES["twist"] if entry.widget == "drive-pad" else None


def _entry(label: str, type_: str, connector: DescribedConnector, known: OriginalType | None) -> CatalogueEntry:
    is_whole = known is not None and bool(known.channels)
    data_type = known.data_type if known is not None and is_whole else connector.data_type
    if data_type is None:
        assert known is not None
        data_type = known.data_type
    return CatalogueEntry(
        label=label,
        type=type_ or data_type.value,
        kind=Kind.VIDEO if data_type is MosaicDataType.MEDIA else Kind.DATA,
        data_type=data_type,
        direction=Direction.BOTH if is_whole else data_type.direction,
        channels=_channels(label, data_type, connector, known),
        widget=connector.widget or (known.widget if known is not None else None),
    )


def _channels(
    label: str, data_type: MosaicDataType, connector: DescribedConnector, known: OriginalType | None
) -> tuple[ChannelEntry, ...]:
    if data_type is MosaicDataType.MEDIA:
        return ()
    if known is not None and known.channels:
        return tuple(ChannelEntry(label=label + half.label, data_type=half.data_type) for half in known.channels)
    parallel_num = connector.parallel_num or (known.parallel_num if known is not None else 0)
    if parallel_num and data_type.direction is Direction.TO_OPERATOR:
        return tuple(ChannelEntry(label=f"{label}-{number}", data_type=data_type) for number in range(parallel_num))
    return (ChannelEntry(label=label, data_type=data_type),)
