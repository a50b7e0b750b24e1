"""The catalogue: what a robot announces about its connectors.

On the signaling socket it travels in short form with a hash; message schemas follow over the control channel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Any

from pydantic import Field

from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.wire_model import PlainText, WireModel, to_json


class ChannelEntry(WireModel):
    """One data channel of a connector; most connectors have one whose label is the connector's."""

    label: PlainText
    data_type: MosaicDataType


class CatalogueEntry(WireModel):
    """One connector as operators see it."""

    label: PlainText
    type: PlainText
    kind: Kind = Kind.DATA
    data_type: MosaicDataType
    direction: Direction
    channels: tuple[ChannelEntry, ...] = ()
    delivery: Delivery = Delivery.RELIABLE
    widget: str | None = Field(default=None, description="Hint: the widget that shows this connector best.")
    schema_id: PlainText | None = Field(default=None, description="The known shape of its messages: `mosaic/Twist@1`.")
    message_schema: dict[str, Any] | None = Field(default=None, description="JSON Schema of one message, with units.")
    answer_schema: dict[str, Any] | None = Field(
        default=None, description="Of a connector that answers requests: JSON Schema of an answer."
    )
    safety: dict[str, Any] | None = Field(default=None, description="The limits that the robot enforces.")

    def short(self) -> CatalogueEntry:
        """Without the schema, for the signaling socket."""
        return self.model_copy(update={"message_schema": None, "answer_schema": None})


class Catalogue(WireModel):
    """All connectors of one robot, in the order of its YAML file."""

    hash: str
    entries: tuple[CatalogueEntry, ...]

    @classmethod
    def of(cls, entries: Iterable[CatalogueEntry]) -> Catalogue:
        """A catalogue with its hash: the first 16 hex digits of the SHA-256 over its full JSON."""
        full = tuple(entries)
        text = to_json([entry.wire() for entry in full])
        return cls(hash=hashlib.sha256(text.encode()).hexdigest()[:16], entries=full)

    def short(self) -> Catalogue:
        """The same catalogue (same hash) without schemas."""
        return Catalogue(hash=self.hash, entries=tuple(entry.short() for entry in self.entries))
