"""A child process of the demo: its own session, its output in a file, ended politely and then surely."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from mosaic_sim.demo.errors import DemoFailed

STOP_PATIENCE_S = 1.5
"""Server and robot promise to end within 2 s; the demo as a whole, too."""
LOG_LINES = 12
_PR_SET_PDEATHSIG = 1


def mosaic_command(*arguments: str) -> list[str]:
    """The command line of ``mosaic …`` in this Python, whether or not the console script is on the path."""
    return [sys.executable, "-m", "mosaic_core.cli.main", *arguments]


class Child:
    """A running program. Its session is its own, so that Ctrl+C reaches the demo alone, which ends it in order."""

    def __init__(
        self, name: str, command: Sequence[str], log: Path, environment: Mapping[str, str] | None = None
    ) -> None:
        self.name = name
        self._log = log
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, **(environment or {})},
                start_new_session=True,
                preexec_fn=_death_follower(),
            )

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """``None`` while it runs."""
        return self._process.poll()

    def check_alive(self) -> None:
        """Raise :class:`DemoFailed` with the last lines of its log if it has ended."""
        if self.exit_code is not None:
            raise DemoFailed(f"the {self.name} ended with exit code {self.exit_code}", details=self.last_lines())

    def last_lines(self, count: int = LOG_LINES) -> str:
        lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines()
        return "\n".join(lines[-count:])

    def ask_to_end(self) -> None:
        if self.exit_code is None:
            self._process.terminate()

    def end(self, deadline_s: float) -> None:
        """Wait until ``deadline_s`` of the monotonic clock, then kill it with everything it started."""
        try:
            self._process.wait(max(0.0, deadline_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def end_all(children: Iterable[Child]) -> None:
    """End all at the same time, so that the slowest one decides and not their sum."""
    children = list(children)
    deadline_s = time.monotonic() + STOP_PATIENCE_S
    for child in children:
        child.ask_to_end()
    for child in children:
        child.end(deadline_s)


def _death_follower() -> Callable[[], None] | None:
    """On Linux: has the kernel end the child when the demo dies without a chance to do so itself (kill -9)."""
    if sys.platform != "linux":
        return None
    prctl = ctypes.CDLL(None).prctl

    def follow() -> None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)

    return follow
