"""Reads and writes the numbers of a parsed JSON message, a dict of dicts, by their dotted paths."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mosaic_core.words.errors import Refused

HUGE = 1e100
"""No command means this; below it no length overflows."""


class OutOfRange(Refused):
    """A field that is limited holds no finite number. The text names it."""

    def __init__(self, message: str) -> None:
        super().__init__("safety.out_of_range", message)


def value_at(message: Mapping[str, Any], path: tuple[str, ...], field: str) -> Any:
    """What stands at ``path``; raises :class:`KeyError` where nothing does, :class:`OutOfRange` where nothing can."""
    value: Any = message
    for key in path:
        if not isinstance(value, Mapping):
            raise OutOfRange(f"{field}: no number can be there, {key} is looked for in a {type(value).__name__}")
        value = value[key]
    return value


def number_at(message: Mapping[str, Any], path: tuple[str, ...], field: str) -> float | None:
    """The finite number at ``path``, ``None`` if it is missing. Raises :class:`OutOfRange`."""
    try:
        value = value_at(message, path, field)
    except KeyError:
        return None
    return finite_number(value, field)


def finite_number(value: Any, field: str) -> float:
    """``value`` as a number; raises :class:`OutOfRange` where it is none, or not finite."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise OutOfRange(f"{field} is no number but a {type(value).__name__}")
    if isinstance(value, int):
        return float(max(-HUGE, min(HUGE, value)))
    if value - value != 0.0:
        raise OutOfRange(f"{field} is not finite")
    return value


def put(shaped: dict[str, Any], message: Mapping[str, Any], path: tuple[str, ...], value: Any) -> None:
    """Write into ``shaped``, whose inner dicts are those of ``message`` until they are written to."""
    inner, original = shaped, message
    for key in path[:-1]:
        deeper = original.get(key, {})
        if inner.get(key, deeper) is deeper:
            inner[key] = dict(deeper)
        inner, original = inner[key], deeper
    inner[path[-1]] = value
