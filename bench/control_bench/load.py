"""What else the machine has to do meanwhile."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

BURNER = "import os, time\nparent = os.getppid()\nwhile os.getppid() == parent:\n    sum(range(100_000))"
"""Counts for ever, but never longer than whoever started it lives."""


@contextmanager
def saturated_cpu() -> Iterator[None]:
    """One process per core that does nothing but use it."""
    burners = [subprocess.Popen([sys.executable, "-c", BURNER]) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()
