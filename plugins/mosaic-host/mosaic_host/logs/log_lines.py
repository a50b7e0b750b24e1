"""Makes messages of lines of logs, and keeps their rate. Pure but for counting."""

from __future__ import annotations

import re
from typing import Literal

from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.messages import Log

Level = Literal["debug", "info", "warn", "error", "fatal"]
MAX_TEXT = 4096
MAX_NAME = 128
_LOOKED_AT = 120
"""Characters at a line's begin in which its level stands; what follows is what somebody says."""
_ESCAPES = re.compile(r"\x1b\[[0-?]*[ -/]*[@-~]")
_CONTROLS = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")
_WORD = re.compile(r"\b(TRACE|DEBUG|INFO|NOTICE|WARN|WARNING|ERROR|ERR|CRITICAL|FATAL|PANIC)\b")
_LEVELS: dict[str, Level] = {
    "TRACE": "debug", "DEBUG": "debug", "INFO": "info", "NOTICE": "info", "WARN": "warn", "WARNING": "warn",
    "ERROR": "error", "ERR": "error", "CRITICAL": "fatal", "FATAL": "fatal", "PANIC": "fatal",
}  # fmt: skip


def readable(raw: bytes) -> str:
    """The text of a line without colours and control characters; what is no UTF-8 becomes �."""
    text = _ESCAPES.sub("", raw.decode(errors="replace"))
    return _CONTROLS.sub(" ", text).strip()[:MAX_TEXT]


def level_of(text: str) -> Level:
    """The level that a line names in capital letters near its begin; ``info`` where it names none."""
    found = _WORD.search(text[:_LOOKED_AT])
    return "info" if found is None else _LEVELS[found[1]]


class LogPace:
    """Lets the lines of one handler through, at most ``max_rate_hz``, and counts the others. Handler's thread."""

    def __init__(self, handler: Handler, max_rate_hz: float) -> None:
        self._handler = handler
        self._bucket = TokenBucket.of_rate(max_rate_hz)
        self._refusals = RefusedInput(handler)

    def admits(self, message: Log) -> bool:
        """Whether it goes out."""
        if self._bucket.admits(self._handler.monotonic_s()):
            return True
        self._handler.count_loss("thinned")
        return False

    def refuse(self, why: object, lines: int = 1) -> None:
        """Lines can't be used: counted each time, logged once in a while."""
        self._refusals.add("a line", why, lines)
