"""What kind of thing travels on a connector, and how it travels: the words of the catalogue."""

from enum import StrEnum

from mosaic_core.words.errors import ConnectionFailed, hint_at


class MosaicDataType(StrEnum):
    """The eight data types of MOSAIC. ``r2u`` is robot to user, ``u2r`` user to robot."""

    JSON_R2U = "json-r2u"
    JSON_U2R = "json-u2r"
    JSON_BI = "json-bi"
    STRING_R2U = "string-r2u"
    STRING_U2R = "string-u2r"
    BYTE_R2U = "byte-r2u"
    BYTE_U2R = "byte-u2r"
    MEDIA = "media"

    @classmethod
    def named(cls, name: str) -> "MosaicDataType":
        """The data type of this name; raises :class:`ConnectionFailed` that names the nearest one."""
        try:
            return cls(name)
        except ValueError:
            hint = hint_at(name, cls)
            message = f"There is no data type {name!r}{hint}"
            raise ConnectionFailed(message, code="channel.unknown_data_type") from None

    @property
    def direction(self) -> "Direction":
        """Which way such data flows."""
        if self is MosaicDataType.JSON_BI:
            return Direction.BOTH
        return Direction.TO_ROBOT if self.value.endswith("u2r") else Direction.TO_OPERATOR


class Direction(StrEnum):
    """Which way the data of a connector flows."""

    TO_OPERATOR = "to-operator"
    TO_ROBOT = "to-robot"
    BOTH = "both"


class Kind(StrEnum):
    """Whether a connector is data, a picture or sound."""

    DATA = "data"
    VIDEO = "video"
    AUDIO = "audio"


class Delivery(StrEnum):
    """How the data of a connector travels (see ``docs/topics/delivery.md``)."""

    RELIABLE = "reliable"
    """Ordered and complete; the queue is bounded and a full one is reported to the sender."""
    LATEST = "latest"
    """Unordered, never repeated; a newer value replaces one that still waits."""
    BULK = "bulk"
    """Ordered and complete, in chunks, behind everything else."""
