"""Tells at which line the code of a plugin is that takes long before anything runs: an import that waits for ever would
look like a command that hangs."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from traceback import extract_stack

from mosaic_core.runtime.threads.code_places import innermost_own
from mosaic_core.words.errors import NOWHERE

logger = logging.getLogger(__name__)

PATIENCE_S = 4.0
"""Large libraries take a second or two on a small computer; a person begins to wonder after three."""


@contextmanager
def told_when_slow(what: str, tell: Callable[[str], object] | None = None) -> Iterator[None]:
    """Warn once if the code within takes longer than :data:`PATIENCE_S`. ``what`` begins a sentence: ``the import of
    connector type 'x'``. ``tell`` is called in place of the log, on a thread of its own. Any thread."""
    timer = threading.Timer(PATIENCE_S, _tell, (what, threading.get_ident(), tell or logger.warning))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _tell(what: str, thread: int, tell: Callable[[str], object]) -> None:
    frame = sys._current_frames().get(thread)
    line = innermost_own(extract_stack(frame)) if frame is not None else NOWHERE
    at = f", at {line}" if line.file else ""
    tell(f"{what} goes on for {PATIENCE_S:g} s already{at}; Ctrl-C ends the wait")
