"""A program that we started: in a session of its own, ended politely and then surely, together with what it started."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import IO, Any

STOP_PATIENCE_S = 1.5
"""Server and robot promise to end within 2 s; whoever started them, too."""
_PR_SET_PDEATHSIG = 1


class ChildProcess:
    """A running program. Its session is its own, so that Ctrl+C reaches us alone, and we end it in order.

    ``follows_us``: on Linux the kernel ends it when we die without a chance to do so (kill -9). That needs code between
    fork and exec, so ask for it only where no other thread runs. Streams are those of :class:`subprocess.Popen`.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        stdin: int | IO[Any] = subprocess.DEVNULL,
        stdout: int | IO[Any] = subprocess.DEVNULL,
        stderr: int | IO[Any] = subprocess.DEVNULL,
        environment: Mapping[str, str] | None = None,
        follows_us: bool = False,
    ) -> None:
        self.process = subprocess.Popen(
            command,
            stdin=stdin,
            stdout=stdout,
            stderr=stderr,
            env={**os.environ, **(environment or {})},
            start_new_session=True,
            preexec_fn=_death_follower() if follows_us else None,
        )

    @property
    def pid(self) -> int:
        return self.process.pid

    @property
    def exit_code(self) -> int | None:
        """``None`` while it runs."""
        return self.process.poll()

    def ask_to_end(self) -> None:
        if self.exit_code is None:
            self.process.terminate()

    def end(self, deadline_s: float) -> None:
        """Wait until ``deadline_s`` of the monotonic clock, then kill it with everything it started. Blocks."""
        try:
            self.process.wait(max(0.0, deadline_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


def end_all(children: Iterable[ChildProcess]) -> None:
    """End all at the same time, so that the slowest one decides and not their sum."""
    children = list(children)
    deadline_s = time.monotonic() + STOP_PATIENCE_S
    for child in children:
        child.ask_to_end()
    for child in children:
        child.end(deadline_s)


def _death_follower() -> Callable[[], None] | None:
    if sys.platform != "linux":
        return None
    prctl = ctypes.CDLL(None).prctl

    def follow() -> None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)

    return follow
