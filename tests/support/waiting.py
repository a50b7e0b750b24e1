"""Waits for what other threads and processes do; coroutines have :func:`mosaic_core.testing.until`."""

from __future__ import annotations

import time
from collections.abc import Callable
from subprocess import Popen
from typing import Any

import pytest

PATIENCE_S = 30.0
"""Longer than anything takes on a busy machine; who waits in vain waits once."""


def wait_for(
    condition: Callable[[], object],
    what: str,
    timeout_s: float = PATIENCE_S,
    *,
    alive: Popen[Any] | None = None,
    log: list[str] | None = None,
) -> float:
    """Block until `condition` holds; returns the seconds it took, fails the test with `what` otherwise, and at once
    where the process `alive` has ended. `log` is shown then."""
    start_s = time.monotonic()
    while not condition():
        tail = "\n".join((log or [])[-25:])
        if alive is not None and alive.poll() is not None:
            pytest.fail(f"the process ended with {alive.returncode} while waiting until {what}\n{tail}")
        if time.monotonic() - start_s > timeout_s:
            pytest.fail(f"after {timeout_s} s still not true: {what}\n{tail}")
        time.sleep(0.01)
    return time.monotonic() - start_s
