"""Log lines go to stderr, as text or as one JSON object each. Programs configure logging, libraries never."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from mosaic_core.words.log_lines import TextLines
from mosaic_core.words.plain_text import on_one_line

if TYPE_CHECKING:
    from rich.console import Console


class LogFormat(StrEnum):
    """Forms in which log records are written."""

    TEXT = "text"
    JSON = "json"


class LogLevel(StrEnum):
    """Levels from which on log records are written."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


_FIELDS = {
    "robotId": ("robotId", "robot_id"),
    "peerId": ("peerId", "peer_id"),
    "label": ("label",),
    "code": ("code",),
}
_CHATTY = ("aiortc", "aioice", "av", "libav", "httpx", "httpcore", "asyncio")
"""Libraries that write addresses and session descriptions at INFO; shown only at debug."""
_TELLS_SECRETS = ("websockets",)
"""At debug it writes whole frames, and with them tokens: never shown."""


class JsonLines(logging.Formatter):
    """Formats a log record as a line of JSON: ``{"time", "level", "logger", "message"}`` and, where known, ``robotId``,
    ``peerId``, ``label``, ``code``.
    """

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        for name, spellings in _FIELDS.items():
            value = next((getattr(record, one) for one in spellings if hasattr(record, one)), None)
            if value is not None:
                line[name] = str(value)
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return on_one_line(json.dumps(line, ensure_ascii=False))


class ConsoleLines(logging.Handler):
    """Writes above the live table instead of through it."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self._console = console

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self._console.print(self.format(record), markup=False, highlight=False, soft_wrap=True)
        except Exception:  # noqa: BLE001 - logging must never end the program; the standard says how to report it
            self.handleError(record)


class _From(logging.Filter):
    """Passes records from a level on, and those of a logger that has a level of its own: a plugin may set that of the
    root to whatever it likes."""

    def __init__(self, level: int) -> None:
        super().__init__()
        self._level = level

    def filter(self, record: logging.LogRecord) -> bool:
        return record.levelno >= (logging.getLogger(record.name).level or self._level)


def set_up_logging(level: LogLevel, log_format: LogFormat = LogFormat.TEXT, console: Console | None = None) -> None:
    """Configure the root logger of this program; ``console`` is that of a live table."""
    as_json = log_format is LogFormat.JSON
    handler = ConsoleLines(console) if console is not None and not as_json else logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines() if as_json else TextLines("%(asctime)s %(levelname)-7s %(message)s", "%H:%M:%S"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level.value.upper())
    handler.addFilter(_From(logging.getLevelNamesMapping()[level.value.upper()]))
    for name in _CHATTY:
        logging.getLogger(name).setLevel(logging.DEBUG if level is LogLevel.DEBUG else logging.WARNING)
    for name in _TELLS_SECRETS:
        logging.getLogger(name).setLevel(logging.WARNING)
