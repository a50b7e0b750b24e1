"""Finds in a message what JSON doesn't know, and says what to write instead."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from datetime import date, time
from typing import Any

from mosaic_core.contract.declared.yielded import kind_of
from mosaic_core.words.wire_model import MAX_DEPTH, to_json


def encoded(value: Any) -> bytes:
    """``value`` as JSON. Raises :class:`ValueError` or :class:`TypeError` with the words of :func:`odd_part` for what
    JSON does not know, a number that is not finite alone excepted: that is a :class:`ValueError` of its own."""
    try:
        return to_json(value).encode()
    except (TypeError, ValueError, RecursionError) as error:
        said = odd_part(value)
        if not said:
            raise
        raise TypeError(said) from error


def odd_part(value: Any) -> str:
    """The first part of ``value`` that JSON does not know, ``'pose.x' as set, which …``, and what to write instead; of
    numbers that are not finite nothing."""
    field, what, cure = next(_odd_parts(value), ("", "", ""))
    as_what = f"{field.encode('utf-8', 'backslashreplace').decode()[:80]!r} as {what}" if field else what
    return f"{as_what}, which JSON does not know: {cure}" if what else ""


def _odd_parts(value: Any, path: str = "", depth: int = 0) -> Iterator[tuple[str, str, str]]:
    """``(dotted path, what it is, cure)`` of each part that is no number, text, list, mapping, truth or null, or is
    nested too deeply; of a key that is none that of the key."""
    if isinstance(value, dict | list | tuple) and depth > MAX_DEPTH:
        yield path, f"a {kind_of(value)} without end", f"nest it {MAX_DEPTH} deep at most, and never in itself"
    elif isinstance(value, dict):
        for key, inner in value.items():
            place = f"{path}.{key}" if path else str(key)
            if isinstance(key, float) and not math.isfinite(key):
                yield place, f"a key {key}", "name it with text"
            elif not (key is None or isinstance(key, str | int | float)):
                yield place, kind_of(key), _cure_of(key)
            elif isinstance(key, str):
                yield from _half_characters(key, place)
            yield from _odd_parts(inner, place, depth + 1)
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value):
            yield from _odd_parts(inner, f"{path}.{index}" if path else str(index), depth + 1)
    elif isinstance(value, str):
        yield from _half_characters(value, path)
    elif not (value is None or isinstance(value, int | float)):
        yield path, kind_of(value), _cure_of(value)


def _half_characters(text: str, path: str) -> Iterator[tuple[str, str, str]]:
    """Python has them where a name of the file system is not UTF-8."""
    if text.encode(errors="ignore").decode() != text:
        yield path, "text with half a character", "write .encode(errors='replace').decode() of it"


def _cure_of(odd: object) -> str:
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
