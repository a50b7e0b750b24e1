"""The base of standard messages, and what their fields share."""

from __future__ import annotations

import time
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field

from mosaic_core.contract.params import Message, unit


class StandardMessage(Message):
    """A message that whoever receives it knows by its :attr:`schema_id`: operators decode it, the dashboard has its
    widget. Immutable. A subclass with more fields keeps the id: who knows the message ignores what was added."""

    model_config = ConfigDict(frozen=True)
    given_in: ClassVar[str] = ""
    """The frame of its numbers, for people."""
    shape_from: ClassVar[str] = ""
    """Whose practice its names and units follow, for people."""
    ros_type: ClassVar[str] = ""
    """The ROS 2 type that holds the same."""


def absent(unit_name: str = "", **more: Any) -> Any:
    """A field that may be unknown: ``None``, and then it is not sent at all."""
    extra = unit(unit_name) if unit_name else None
    return Field(default=None, exclude_if=_is_none, json_schema_extra=extra, **more)


def _is_none(value: object) -> bool:
    return value is None


Metres = Annotated[float, Field(json_schema_extra=unit("m"))]
Radians = Annotated[float, Field(json_schema_extra=unit("rad"))]
Seconds = Annotated[float, Field(json_schema_extra=unit("s"))]
Name = Annotated[str, Field(max_length=128)]
Sentence = Annotated[str, Field(max_length=4096)]


def stamp() -> Any:
    """The field ``timestamp``: when it was measured."""
    return absent("µs", ge=0, description="Since 1970-01-01 UTC.")


def wall_time_us() -> int:
    """The ``timestamp`` of now. For display and logs only: a robot's wall clock may jump."""
    return time.time_ns() // 1000


def frame(what: str = "The frame of its numbers.") -> Any:
    """The field ``frame_id``."""
    return absent(max_length=128, description=what)


def check_lengths(wanted: str, count: int, **lists: list[Any] | None) -> None:
    """Raises :class:`ValueError` that names the list which is neither absent nor empty and has another length."""
    for name, values in lists.items():
        if values and len(values) != count:
            raise ValueError(f"{name} has {len(values)} values for {count} {wanted}")
