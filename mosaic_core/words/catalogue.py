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

WIDGET_HINTS = (
    "audio",
    "battery",
    "bytes",
    "connection-check",
    "diagnostics",
    "drive-pad",
    "gps",
    "gps-position",
    "gripper-command",
    "imu",
    "joint-command",
    "joints",
    "joystick",
    "json-sender",
    "laser-scan",
    "map",
    "message-log",
    "point-cloud",
    "pose-trail",
    "push-to-talk",
    "raw-json",
    "recorder",
    "request",
    "text-log",
    "time-plot",
    "value-cards",
    "video",
)
"""Every hint that a widget of the dashboard answers to; its registry is tested against this."""


def is_widget_hint(name: str) -> bool:
    """Whether some widget may answer to it: one of the dashboard's, or that of a plugin (``acme-gripper/Grip``)."""
    return name in WIDGET_HINTS or "/" in name


MAX_WIDGET_MODULE_BYTES = 2 * 1024 * 1024
"""Of the ES module in which a plugin ships widgets: a page waits for it, and whoever serves it keeps it in memory."""


class WidgetModule(WireModel):
    """The ES module in which an installed distribution ships widgets: what a robot announces and a server offers."""

    name: str = Field(pattern="^[a-z0-9][a-z0-9._-]*$", max_length=64, description="The module of `acme-arm/ArmPanel`.")
    distribution: PlainText
    version: PlainText
    sha256: str = Field(pattern="^[0-9a-f]{64}$", description="Of its bytes: a page loads these or none.")
    size_bytes: int = Field(ge=0, le=MAX_WIDGET_MODULE_BYTES)


class ChannelEntry(WireModel):
    """One data channel of an entry; most have one whose label is the entry's."""

    label: PlainText
    data_type: MosaicDataType


class CatalogueEntry(WireModel):
    """One track, one data channel or several channels that mean something only together, as operators see it. The
    handlers of one connector are an entry each, of the same type."""

    label: PlainText
    type: PlainText
    connector: PlainText | None = Field(
        default=None, description="Its connector's label in the robot's file, where several handlers are of one."
    )
    kind: Kind = Kind.DATA
    data_type: MosaicDataType
    direction: Direction
    channels: tuple[ChannelEntry, ...] = ()
    delivery: Delivery = Delivery.RELIABLE
    widget: str | None = Field(default=None, description="Hint: the widget that shows it best.")
    widget_module: WidgetModule | None = Field(default=None, description="Where that widget is, if a plugin ships it.")
    schema_id: PlainText | None = Field(default=None, description="The known shape of its messages: `mosaic/Twist@1`.")
    message_schema: dict[str, Any] | None = Field(
        default=None, description="JSON Schema of one message, with units; both ways: of one that operators send."
    )
    sent_schema_id: PlainText | None = Field(
        default=None, description="Both ways: the known shape of what the robot sends."
    )
    sent_schema: dict[str, Any] | None = Field(
        default=None, description="Both ways: JSON Schema of a message that the robot sends."
    )
    answer_schema: dict[str, Any] | None = Field(
        default=None, description="Of a connector that answers requests: JSON Schema of an answer."
    )
    answer_within_s: float | None = Field(
        default=None, description="Of such a connector: how long a request may take, from its arrival to its end."
    )
    item_names: tuple[PlainText, ...] | None = Field(
        default=None,
        description="The names that a command may have, such as those of joints, where they are known.",
    )
    safety: dict[str, Any] | None = Field(default=None, description="The limits that the robot enforces.")

    def short(self) -> CatalogueEntry:
        """Without schemas, for the signaling socket."""
        return self.model_copy(update=dict.fromkeys(("message_schema", "sent_schema", "answer_schema")))


class Catalogue(WireModel):
    """All that operators see of one robot, in the order of its YAML file."""

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
