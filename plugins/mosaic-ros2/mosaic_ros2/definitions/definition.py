"""Definitions of ROS 2 messages: the names and types of their fields, in order. Pure.

A type is named as ROS names it, ``sensor_msgs/msg/LaserScan``; a request of a service is
``std_srvs/srv/SetBool_Request``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

FieldShape: TypeAlias = Literal["one", "array", "sequence"]
DefinitionKind: TypeAlias = Literal["msg", "srv", "action"]

NUMBERS = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
    "int64": 8, "uint64": 8, "float32": 4, "float64": 8,
}  # fmt: skip
"""Bytes of each primitive. ``byte`` and ``char`` are ``uint8`` by another name."""
TEXTS = ("string", "wstring")
EMPTY_MEMBER = "structure_needs_at_least_one_member"
"""What ROS puts into a message without fields: IDL knows no empty struct."""

_TYPE_NAME = re.compile(r"^([A-Za-z][A-Za-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)$")

_EXAMPLES: dict[str, str] = {
    "msg": "sensor_msgs/msg/LaserScan", "srv": "std_srvs/srv/Trigger", "action": "nav2_msgs/action/NavigateToPose",
}  # fmt: skip


class DefinitionError(ValueError):
    """A definition that can't be read, or a type that nobody has defined. The text names culprit, place and cure."""


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field. ``base``: a primitive, ``string``, ``wstring`` or the full name of a message.

    ``size``: the length of an array, or the bound of a sequence (0: none).
    """

    base: str
    shape: FieldShape = "one"
    size: int = 0
    text_bound: int = 0

    @property
    def is_number(self) -> bool:
        return self.base in NUMBERS

    @property
    def is_text(self) -> bool:
        return self.base in TEXTS

    @property
    def is_message(self) -> bool:
        return not (self.is_number or self.is_text)

    def __str__(self) -> str:
        """As a ``.msg`` file has it."""
        base = f"{self.base}<={self.text_bound}" if self.text_bound else self.base
        bound = f"<={self.size}" if self.shape == "sequence" and self.size else str(self.size or "")
        return base if self.shape == "one" else f"{base}[{bound}]"


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a message."""

    name: str
    type: FieldType


@dataclass(frozen=True, slots=True)
class Definition:
    """A message: its full name and its fields."""

    name: str
    fields: tuple[Field, ...]

    def messages_in_it(self) -> tuple[str, ...]:
        """The full names of the messages that its fields are of, each once."""
        return tuple(dict.fromkeys(field.type.base for field in self.fields if field.type.is_message))


def full_name(name: str, kind: DefinitionKind = "msg") -> str:
    """``sensor_msgs/Image``, ``sensor_msgs/msg/Image`` and ``sensor_msgs::msg::dds_::Image_`` as the second one;
    ``kind``: where the name does not say it. Raises :class:`DefinitionError`."""
    text = name.strip()
    if "::" in text:
        text = "/".join(part for part in text.split("::") if part != "dds_").removesuffix("_")
    matched = _TYPE_NAME.match(text)
    if matched is None or matched[3] in _EXAMPLES:
        raise DefinitionError(f"{name[:80]!r} names no ROS type; write it like {_EXAMPLES[kind]}")
    package, own_kind, own = matched.groups()
    return f"{package}/{own_kind or kind}/{own}"


def service_name(name: str) -> str:
    """The full name of a service's type. Raises :class:`DefinitionError`."""
    return _of_kind(name, "srv")


def action_name(name: str) -> str:
    """The full name of an action's type. Raises :class:`DefinitionError`."""
    return _of_kind(name, "action")


def _of_kind(name: str, kind: DefinitionKind) -> str:
    found = full_name(name, kind)
    if found.split("/")[1] != kind:
        raise DefinitionError(f"{name[:80]!r} is of another kind; write it like {_EXAMPLES[kind]}")
    return found


def dds_name(name: str) -> str:
    """The name of the type on the wire: ``sensor_msgs::msg::dds_::Image_``."""
    package, kind, own = full_name(name).split("/")
    return f"{package}::{kind}::dds_::{own}_"
