"""Reads and writes the fields of a drilled message by their dotted paths, also those in lists, and tells which a list
has."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from mosaic_core.machines.commands.message_numbers import OutOfRange
from mosaic_core.machines.commands.number_list import NumberList

Lists = Sequence[NumberList]


def put(message: dict[str, Any], field: str, value: Any, lists: Lists = ()) -> None:
    """Set a field by its dotted path, making what is missing on the way."""
    its = next((one for one in lists if one.holds(field)), None)
    if its is not None:
        _put_in_list(message, its, its.key_of(field), value)
        return
    *parents, last = field.split(".")
    for name in parents:
        inner = message.get(name)
        if not isinstance(inner, dict):
            inner = message[name] = {}
        message = inner
    message[last] = value


def at(message: Any, field: str, lists: Lists = ()) -> float:
    """A field's number by its dotted path; 0 where there is none."""
    its = next((one for one in lists if one.holds(field)), None)
    if its is not None:
        try:
            return its.read(message).get(field, 0.0) if isinstance(message, Mapping) else 0.0
        except OutOfRange:
            return 0.0
    message = _value(message, field)
    return float(message) if isinstance(message, int | float) and not isinstance(message, bool) else 0.0


def in_lists(positions: Iterable[str], lists: Lists, names: Sequence[str], example: Mapping[str, Any]) -> list[str]:
    """``positions`` with ``path.*`` as what stands for it: the ``names`` that the connector knows, else those that its
    limits name, else the numbers that an example of a message has. Empty for a list of which nobody knows any."""
    found: dict[str, None] = {}
    for field in positions:
        its = next((one for one in lists if one.holds(field)), None)
        fields = [field] if its is None else _fields_of(its, field, names, positions, example)
        found.update(dict.fromkeys(fields))
    return list(found)


def _fields_of(
    its: NumberList, field: str, names: Sequence[str], positions: Iterable[str], example: Mapping[str, Any]
) -> list[str]:
    if field != its.every:
        return [field]
    if its.names:
        known = [name for name in names if name in its.known] or sorted(its.known)
        named = [its.key_of(one) for one in positions if its.holds(one) and one != its.every]
        return [f"{its.path}.{key}" for key in known or named]
    said = _value(example, its.path)
    return [f"{its.path}.{index}" for index in range(max(1, len(said) if isinstance(said, list) else 0))]


def _put_in_list(message: dict[str, Any], its: NumberList, key: str, value: Any) -> None:
    values, names = _list_at(message, its.path), _list_at(message, its.names) if its.names else []
    if its.names and key not in names:
        names.append(key)
        values.append(value)
    elif its.names:
        values[names.index(key)] = value
    else:
        values += [0.0] * (int(key) + 1 - len(values))
        values[int(key)] = value
    put(message, its.path, values)
    if its.names:
        put(message, its.names, names)


def _list_at(message: Mapping[str, Any], path: str) -> list[Any]:
    found = _value(message, path)
    return list(found) if isinstance(found, list) else []


def _value(message: Any, path: str) -> Any:
    for name in path.split("."):
        message = message.get(name) if isinstance(message, Mapping) else None
    return message
