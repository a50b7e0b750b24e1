"""Formats log records as lines that nobody can forge: control characters in what they quote are spelled out."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import TypeAlias

from mosaic_core.words.plain_text import on_one_line

_INDENT = "    "

ExceptionInfo: TypeAlias = tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]


class TextLines(logging.Formatter):
    """A record on one line for people; below it, indented, the traceback if there is one."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        return on_one_line(super().formatMessage(record))

    def formatException(self, ei: ExceptionInfo) -> str:
        lines = super().formatException(ei).split("\n")
        return "\n".join(_INDENT + on_one_line(line) for line in lines)
