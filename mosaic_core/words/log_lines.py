"""Log lines that nobody can forge: what a stranger chose (a name, a reason) has no control characters in them."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import TypeAlias

_CONTROLS = (*range(0x20), *range(0x7F, 0xA0))
_DIRECTIONS = (0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A))
"""Marks that end a line or turn what follows round, where a terminal knows them."""
_ESCAPES = {code: f"\\u{code:04x}" for code in (*_CONTROLS, *_DIRECTIONS)}
_INDENT = "    "

ExceptionInfo: TypeAlias = tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]


def on_one_line(text: str) -> str:
    r"""``text`` with every control character spelled as JSON would (``\u001b``)."""
    return text.translate(_ESCAPES)


class TextLines(logging.Formatter):
    """A record on one line for people; below it, indented, the traceback if there is one."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        return on_one_line(super().formatMessage(record))

    def formatException(self, ei: ExceptionInfo) -> str:
        lines = super().formatException(ei).split("\n")
        return "\n".join(_INDENT + on_one_line(line) for line in lines)
