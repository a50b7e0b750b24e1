"""A child process of the demo: its output in a file whose last lines are told when it dies."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from mosaic_core.runtime.lan.child_process import ChildProcess
from mosaic_sim.demo.errors import DemoFailed

LOG_LINES = 12
MOST_NEW_BYTES = 64 * 1024
"""Of one look: a program that prints without end fills a terminal, and no memory."""


def mosaic_command(*arguments: str) -> list[str]:
    """The command line of ``mosaic …`` in this Python, whether or not the console script is on the path."""
    return [sys.executable, "-m", "mosaic_core.cli.main", *arguments]


class Child(ChildProcess):
    """A running program of the demo, which ends with it."""

    def __init__(
        self, name: str, command: Sequence[str], log: Path, environment: Mapping[str, str] | None = None
    ) -> None:
        self.name = name
        self._log = log
        self._seen_bytes = 0
        with log.open("wb") as output:
            super().__init__(command, stdout=output, stderr=subprocess.STDOUT, environment=environment, follows_us=True)

    def check_alive(self) -> None:
        """Raise :class:`DemoFailed` with the last lines of its log if it has ended."""
        if self.exit_code is not None:
            raise DemoFailed(f"the {self.name} ended with exit code {self.exit_code}", details=self.last_lines())

    def last_lines(self, count: int = LOG_LINES) -> str:
        lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines()
        return "\n".join(lines[-count:])

    def new_lines(self) -> list[str]:
        """The whole lines that it has written since this was asked last."""
        with self._log.open("rb") as log:
            log.seek(self._seen_bytes)
            written = log.read(MOST_NEW_BYTES)
        whole = written[: written.rfind(b"\n") + 1] if len(written) < MOST_NEW_BYTES else written
        self._seen_bytes += len(whole)
        return whole.decode("utf-8", errors="replace").splitlines()
