"""Text that people chose, without what acts on a terminal or a page: control characters, line ends, marks of direction.

A name, a reason or a message of the other side passes here once, when it is read from the wire: whoever shows it later
need not think of it. Lines of the log can't be forged either: there control characters are spelled out.
"""

from __future__ import annotations

import logging
from types import TracebackType
from typing import Annotated, TypeAlias

from pydantic import AfterValidator, Field

_BLANKS = (*range(0x09, 0x0E), 0x85, 0x2028, 0x2029)
"""They end a line or move along it."""
_CONTROLS = (*range(0x20), *range(0x7F, 0xA0))
"""C0 and C1 (ISO 6429): a terminal takes some of them for orders."""
_DIRECTIONS = (0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
"""They turn what follows round (UAX #9): "exe.txt" would read as "txt.exe"."""
_UNSEEN = (0x200B, 0x2060, 0xFEFF, 0x00AD)
"""They take no room: two names would look alike."""
_REPLACED = {
    **dict.fromkeys((*_CONTROLS, *_DIRECTIONS), "\ufffd"),
    **dict.fromkeys(_UNSEEN, None),
    **dict.fromkeys(_BLANKS, " "),
}


def plain(text: str) -> str:
    """``text`` on one line, no longer than before: blanks for ends of lines, "\ufffd" for what would act."""
    return text.translate(_REPLACED)


PlainText: TypeAlias = Annotated[str, AfterValidator(plain), Field(json_schema_extra={"format": "plain"})]
"""A field of a message that people read. Pages read it alike, by the format in the schema."""


_ESCAPES = {code: f"\\u{code:04x}" for code in (*_BLANKS, *_CONTROLS, *_DIRECTIONS)}
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
