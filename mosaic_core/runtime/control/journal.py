"""Keeps the journal of who did what on this robot: the newest entries, bounded, and repeated refusals merged into one
entry; and the file of JSON lines that keeps them all.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from io import TextIOWrapper
from itertools import islice
from logging.handlers import QueueListener, RotatingFileHandler
from pathlib import Path
from typing import cast

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.words.control import JournalEntry
from mosaic_core.words.wire_model import to_json

logger = logging.getLogger(__name__)

MAX_ENTRIES = 2000
MERGE_S = 5.0
"""The same refusal is written at once, and then once per this long with how often it happened."""
MAX_MERGED = 256
PAUSE_S = 5.0
"""A command after so long a silence is worth an entry."""


@dataclass(slots=True)
class _Merged:
    since_s: float
    count: int
    subject: str
    refusal: GateRefusal
    who: str
    account: str


class RobotJournal:
    """Keeps the newest entries of one robot's journal. Event loop only. ``written``: gets every entry too."""

    def __init__(self, written: Callable[[JournalEntry], object] = lambda entry: None) -> None:
        # As JSON text: one small piece of memory each. An entry as an object is a dozen pieces, 1.3 KB together, that
        # lie between those of the operators of its time and keep what they leave from being given back.
        self._texts: deque[str] = deque(maxlen=MAX_ENTRIES)
        self._number = 0
        self._written = written
        self._refused: dict[tuple[str, str, str, str], _Merged] = {}
        self._commanded: dict[str, tuple[str, float]] = {}

    def note(
        self,
        what: str,
        *,
        who: str = "",
        account: str = "",
        subject: str = "",
        code: str = "",
        gate: str = "",
        message: str = "",
    ) -> None:
        """``who`` is what people call an operator, ``account`` the id that its ticket carries."""
        self._number += 1
        at = datetime.now(UTC).isoformat(timespec="milliseconds")
        entry = JournalEntry(
            number=self._number,
            at=at,
            what=what,
            who=who,
            account=account or None,
            subject=subject,
            code=code,
            gate=gate or None,
            message=message[:200],
        )
        self._texts.append(entry.model_dump_json())
        self._written(entry)

    def refused(self, label: str, sender: Sender, refusal: GateRefusal) -> None:
        """A message was refused. Many alike make few entries, and few lines of the log."""
        now_s, key = time.monotonic(), (sender.peer_id, label, refusal.gate, refusal.code)
        merged = self._refused.get(key)
        if merged is not None:
            merged.count += 1
            return
        self.flush(now_s)
        if len(self._refused) < MAX_MERGED:
            self._refused[key] = merged = _Merged(now_s, 0, label, refusal, name_of(sender), sender.operator_id)
            self._note_refused(merged, refusal.message)

    def accepted(self, label: str, sender: Sender) -> None:
        """A command was accepted: the first one of a peer, or after a pause, is written."""
        now_s = time.monotonic()
        peer_id, at_s = self._commanded.get(label, ("", 0.0))
        self._commanded[label] = (sender.peer_id, now_s)
        if peer_id != sender.peer_id or now_s - at_s > PAUSE_S:
            self.note("command.accepted", who=name_of(sender), account=sender.operator_id, subject=label)

    def lease_changed(self) -> None:
        """The next accepted command of every receiver is the first one again."""
        self._commanded.clear()

    def flush(self, now_s: float) -> None:
        """Write what was merged long enough."""
        for key, merged in list(self._refused.items()):
            if now_s - merged.since_s < MERGE_S:
                continue
            if merged.count == 0:
                del self._refused[key]
                continue
            self._note_refused(merged, f"{merged.count} more")
            merged.since_s, merged.count = now_s, 0

    def _note_refused(self, merged: _Merged, message: str) -> None:
        who, label, gate, code = merged.who, merged.subject, str(merged.refusal.gate), merged.refusal.code
        # as literals: names and labels come from outside, and a line break would forge a line of the log
        why = f": {message!r}" if message else ""
        logger.info("%r: refused a message of %r at the gate %s (%s)%s", label, who, gate, code, why)
        account = merged.account
        self.note("command.refused", who=who, account=account, subject=label, code=code, gate=gate, message=message)

    def newest(self, limit: int, before: int | None = None) -> tuple[JournalEntry, ...]:
        """At most ``limit`` entries older than number ``before``, newest first."""
        newer = 0 if before is None else min(max(0, self._number - before + 1), len(self._texts))
        texts = islice(reversed(self._texts), newer, newer + limit)
        return tuple(JournalEntry.model_validate_json(text) for text in texts)


def name_of(sender: Sender) -> str:
    """What people call an operator."""
    return sender.name or sender.peer_id


MAX_BYTES = 5 * 1024 * 1024
KEPT_FILES = 3
MAX_WAITING = 1000
"""Entries for a disk that stands still; later ones are only in memory."""


class _PrivateFile(RotatingFileHandler):
    """Names of operators are in it: nobody but its owner reads it."""

    def _open(self) -> TextIOWrapper:
        def opener(path: str, flags: int) -> int:
            return os.open(path, flags, 0o600)

        return cast(TextIOWrapper, open(self.baseFilename, self.mode, encoding=self.encoding, opener=opener))

    def handleError(self, record: logging.LogRecord) -> None:
        logger.error("the journal can't be written to %s", self.baseFilename, exc_info=True)


class JournalFile:
    """Writes the journal on a thread of its own, so that a slow disk delays no command: ``write`` never blocks. A file
    that can't be opened is told in the log, and the robot goes on without it."""

    def __init__(self, path: str | Path) -> None:
        self._waiting: queue.Queue[logging.LogRecord] = queue.Queue(MAX_WAITING)
        self._listener: QueueListener | None = None
        try:
            file = _PrivateFile(path, maxBytes=MAX_BYTES, backupCount=KEPT_FILES, encoding="utf-8")
        except OSError as error:
            logger.error("the journal can't be written to %s: %s", path, error)
            return
        self._file = file
        self._listener = QueueListener(self._waiting, file)
        self._listener.start()

    def write(self, entry: JournalEntry) -> None:
        if self._listener is not None:
            text = to_json(entry.wire())
            record = logging.LogRecord("journal", logging.INFO, "", 0, "%s", (text,), None)
            with contextlib.suppress(queue.Full):
                self._waiting.put_nowait(record)

    def close(self) -> None:
        """Write what waits, at most as much as there is."""
        if self._listener is not None:
            with contextlib.suppress(queue.Full):
                self._listener.stop()
            self._file.close()
