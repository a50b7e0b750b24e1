"""Reads the text of ``.msg``, ``.srv`` and ``.action`` files. Pure.

Constants, defaults and comments are left out: they are not sent.
"""

from __future__ import annotations

import re

from mosaic_ros2.definitions.definition import (
    EMPTY_MEMBER,
    NUMBERS,
    TEXTS,
    Definition,
    DefinitionError,
    Field,
    FieldShape,
    FieldType,
    full_name,
)

MAX_FIELDS = 4096
MAX_LENGTH = 1 << 24
"""Longest array that a definition may name."""
_FIELD = re.compile(r"^(?P<type>[A-Za-z][A-Za-z0-9_/]*(?:<=\d+)?(?:\[(?:<=)?\d*\])?)\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)")
_TYPE = re.compile(r"^(?P<base>[A-Za-z][A-Za-z0-9_/]*)(?:<=(?P<bound>\d+))?(?P<many>\[(?P<least><=)?(?P<size>\d*)\])?$")
_UUID = FieldType("unique_identifier_msgs/msg/UUID")
_STAMP = FieldType("builtin_interfaces/msg/Time")
_EMPTY = (Field(EMPTY_MEMBER, FieldType("uint8")),)


def field_type(text: str, package: str) -> FieldType:
    """A type as a file of ``package`` names it: ``float64[36]``, ``string<=10[]``, ``Header``."""
    matched = _TYPE.match(text)
    if matched is None:
        raise DefinitionError(f"{text!r} is no type of a field")
    base, size = matched["base"], int(matched["size"] or 0)
    if size > MAX_LENGTH:
        raise DefinitionError(f"{text!r}: longer than {MAX_LENGTH}")
    if base not in NUMBERS and base not in TEXTS:
        base = full_name(base if "/" in base else "std_msgs/Header" if base == "Header" else f"{package}/{base}")
    shape: FieldShape = "one" if not matched["many"] else "array" if size and not matched["least"] else "sequence"
    return FieldType(base, shape, size, int(matched["bound"] or 0))


def read_message(name: str, text: str) -> Definition:
    """The message ``name`` of this text of a ``.msg`` file. Raises :class:`DefinitionError` with the line."""
    name = full_name(name)
    fields: list[Field] = []
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.split("#", 1)[0].strip()
        if not bare:
            continue
        matched = _FIELD.match(bare)
        if matched is None:
            raise DefinitionError(f"{name}, line {number}: {bare[:60]!r} is no field")
        if bare[matched.end() :].lstrip().startswith("="):
            continue  # a constant
        if any(one.name == matched["name"] for one in fields) or len(fields) >= MAX_FIELDS:
            raise DefinitionError(f"{name}, line {number}: the field {matched['name']!r} is there already")
        fields.append(Field(matched["name"], field_type(matched["type"], name.split("/")[0])))
    return Definition(name, tuple(fields) or _EMPTY)


def read_service(name: str, text: str) -> tuple[Definition, Definition]:
    """The request and the response of this text of a ``.srv`` file."""
    request, response = _parts(name, text, 2)
    return read_message(f"{full_name(name)}_Request", request), read_message(f"{full_name(name)}_Response", response)


def read_action(name: str, text: str) -> tuple[Definition, ...]:
    """The goal, result and feedback of this text of an ``.action`` file, and the messages that ROS makes of them."""
    name = full_name(name)
    own = [
        read_message(f"{name}_{part}", body)
        for part, body in zip(("Goal", "Result", "Feedback"), _parts(name, text, 3), strict=True)
    ]
    return (*own, *action_messages(name))


def action_messages(name: str) -> tuple[Definition, ...]:
    """What ROS sends for every action ``name``: requests, responses and the feedback's message."""
    shapes: dict[str, tuple[Field, ...]] = {
        "SendGoal_Request": (Field("goal_id", _UUID), Field("goal", FieldType(f"{name}_Goal"))),
        "SendGoal_Response": (Field("accepted", FieldType("bool")), Field("stamp", _STAMP)),
        "GetResult_Request": (Field("goal_id", _UUID),),
        "GetResult_Response": (Field("status", FieldType("int8")), Field("result", FieldType(f"{name}_Result"))),
        "FeedbackMessage": (Field("goal_id", _UUID), Field("feedback", FieldType(f"{name}_Feedback"))),
    }
    return tuple(Definition(f"{name}_{part}", fields) for part, fields in shapes.items())


def _parts(name: str, text: str, count: int) -> list[str]:
    parts: list[list[str]] = [[]]
    for line in text.splitlines():
        if line.strip() == "---":
            parts.append([])
        else:
            parts[-1].append(line)
    if len(parts) != count:
        raise DefinitionError(f"{name} has {len(parts)} parts between lines of ---; {count} are expected")
    return ["\n".join(part) for part in parts]
