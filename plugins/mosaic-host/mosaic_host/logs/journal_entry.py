"""Makes a message of an entry of the journal, as ``journalctl --output=json`` writes it. Pure."""

from __future__ import annotations

from typing import Any

from mosaic_core.messages import Log
from mosaic_core.words.wire_model import parsed_object
from mosaic_host.logs.log_lines import MAX_NAME, Level, readable

_LEVELS: tuple[Level, ...] = ("fatal", "fatal", "fatal", "error", "warn", "info", "info", "debug")
"""By the priorities of syslog (RFC 5424, section 6.2.1), 0 to 7."""
MAX_STAMP_US = 2**53 - 1
"""The greatest integer that a page reads exactly."""


def log_of(line: bytes) -> Log:
    """The message of one line. Raises :class:`ValueError` that says what is wrong with it."""
    entry = parsed_object(line)
    message = _bytes_of(entry.get("MESSAGE"))
    if message is None:
        raise ValueError("no MESSAGE, or one that is too large for the journal to write it out")
    name = _text(entry, "_SYSTEMD_UNIT") or _text(entry, "UNIT") or _text(entry, "SYSLOG_IDENTIFIER")
    priority, stamp_us = _number(entry, "PRIORITY"), _number(entry, "__REALTIME_TIMESTAMP")
    return Log(
        level=_LEVELS[priority] if priority is not None and priority < len(_LEVELS) else "info",
        message=readable(message),
        name=name,
        timestamp=stamp_us if stamp_us is not None and stamp_us <= MAX_STAMP_US else None,
    )


def _bytes_of(value: Any) -> bytes | None:
    """A field's bytes: text, or numbers where they are no UTF-8; of a field that occurs several times the first."""
    if isinstance(value, str):
        return value.encode()
    if not isinstance(value, list) or not value:
        return None
    if all(type(one) is int and 0 <= one < 256 for one in value):
        return bytes(value)
    return _bytes_of(value[0])  # as deep as parsed_object lets in


def _text(entry: dict[str, Any], key: str) -> str | None:
    found = _bytes_of(entry.get(key))
    return None if found is None else readable(found)[:MAX_NAME] or None


def _number(entry: dict[str, Any], key: str) -> int | None:
    value = entry.get(key)
    return int(value) if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 20 else None
