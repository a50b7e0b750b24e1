"""Finds a part of a JSON value by its JSON Pointer (RFC 6901). Pure."""

from __future__ import annotations

import re
from typing import Any

MAX_POINTER = 256
_INDEX = re.compile(r"0|[1-9][0-9]{0,8}")
_BAD_ESCAPE = re.compile(r"~(?![01])")


def checked_pointer(pointer: str) -> str:
    """``pointer`` itself. Raises :class:`ValueError` for what RFC 6901 (section 3) does not allow."""
    if pointer and not pointer.startswith("/"):
        raise ValueError(f"{pointer!r} is no JSON Pointer; begin it with /, as in /battery/voltage")
    if _BAD_ESCAPE.search(pointer):
        raise ValueError(f"{pointer!r} is no JSON Pointer; write ~0 for ~ and ~1 for /")
    return pointer


def part_of(value: Any, pointer: str) -> Any:
    """The part of ``value`` that ``pointer`` names. Raises :class:`LookupError` that says where it ends."""
    for token in pointer.split("/")[1:]:
        key = token.replace("~1", "/").replace("~0", "~")  # in this order: ~01 is ~1 (RFC 6901, section 4)
        if isinstance(value, dict) and key in value:
            value = value[key]
        elif isinstance(value, list) and _INDEX.fullmatch(key) and int(key) < len(value):
            value = value[int(key)]
        else:
            raise LookupError(f"nothing is at {pointer}: it ends before {key[:64]!r}")
    return value
