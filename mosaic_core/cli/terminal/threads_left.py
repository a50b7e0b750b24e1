"""Ends a command whatever its plugins left running: Python waits for every thread that is no daemon, and the libraries
of many devices start one while they are imported."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from mosaic_core.cli.terminal.error_report import FAILED, FINE

logger = logging.getLogger(__name__)

PATIENCE_S = 1.0
"""For threads that come to their end by themselves: those of a pool do as soon as Python asks them."""


@contextmanager
def ended_without_threads() -> Iterator[None]:
    """End the process with the code of the command soon after it, also where threads go on that Python would
    wait for; they are told in the log. Main thread, around all that the process does."""
    code = FAILED
    try:
        yield
        code = FINE
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else FINE if ended.code is None else FAILED
        raise
    finally:
        if _left():
            threading.Thread(target=_end, args=(code,), name="mosaic-end-without", daemon=True).start()


def _left() -> list[threading.Thread]:
    """What Python waits for."""
    return [one for one in threading.enumerate() if not one.daemon and one is not threading.main_thread()]


def _end(code: int) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    for thread in _left():
        thread.join(max(0.0, deadline_s - time.monotonic()))
    left = _left()
    if not left:
        return
    logger.warning(
        "ended without waiting for what plugins left running: %s; start such threads with daemon=True, and in the body "
        "of a handler instead of an import",
        ", ".join(map(_told, left)),
    )
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def _told(thread: threading.Thread) -> str:
    from mosaic_core.runtime.threads.stacks import place_of_thread  # every command loads this module, few need it

    place = place_of_thread(thread.ident)
    return f"thread '{thread.name}'" + (f" at {place}" if place else "")
