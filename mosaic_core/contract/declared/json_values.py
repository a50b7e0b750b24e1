"""Finds in a message what JSON doesn't know, and says what to write instead."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import date, time
from typing import Any


def unknown_to_json(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """``(dotted path, value)`` of each part that is no number, text, list, mapping, truth or null; of a key that is
    none the key."""
    if isinstance(value, dict):
        for key, inner in value.items():
            place = f"{path}.{key}" if path else str(key)
            if not (key is None or isinstance(key, str | int | float)):
                yield place, key
            yield from unknown_to_json(inner, place)
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value):
            yield from unknown_to_json(inner, f"{path}.{index}" if path else str(index))
    elif not (value is None or isinstance(value, str | int | float)):
        yield path, value


def cure_of(odd: object) -> str:
    """What to write instead of it."""
    if hasattr(odd, "tolist"):  # of numpy: an array, or one number of it
        is_one = getattr(odd, "shape", None) == ()
        return "write float(…), int(…) or bool(…) of it" if is_one else "write .tolist() of it"
    if isinstance(odd, date | time):
        return "write .isoformat() of it, or a number of seconds"
    if isinstance(odd, bytes | bytearray | memoryview):
        return "send bytes from a DataChannelSendable[bytes], or text of them"
    if isinstance(odd, set | frozenset):
        return "write sorted(…) of it"
    if isinstance(odd, Mapping):
        return "write dict(…) of it"
    return "write numbers, text, lists and mappings"
