"""Runs one program: without a shell, in a process group of its own, with an environment that holds no secret.

Every method runs on the thread of whoever has it open, which never waits longer than :data:`LOOK_S` for bytes.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import IO

LOOK_S = 0.1
"""How soon somebody who stops is noticed."""
GRACE_S = 1.0
"""From the wish to end to the order: a robot that stops waits about as long for its handlers."""
PIECE_BYTES = 65_536
SEARCH_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
"""Where programs are looked for: not where the robot's own environment says."""


@dataclass(frozen=True, slots=True)
class Said:
    """What the program said since the last look. ``is_over``: it has closed both pipes and says no more."""

    out: bytes = b""
    error: bytes = b""
    is_over: bool = False


class RunningProgram:
    """A program that runs in this ``with`` block, and ends with it, whatever it started in its group too."""

    def __init__(self, argv: Sequence[str], environment: Mapping[str, str] | None = None, folder: str = "/") -> None:
        self._argv = list(argv)
        self._environment = {"PATH": SEARCH_PATH, "LANG": "C.UTF-8", **(environment or {})}
        self._folder = folder
        self._process: subprocess.Popen[bytes]
        self._selector: selectors.BaseSelector

    def __enter__(self) -> RunningProgram:
        """Raises :class:`OSError`."""
        self._process = subprocess.Popen(
            self._argv,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=self._environment,
            cwd=self._folder,
            start_new_session=True,
            bufsize=0,
        )
        self._selector = selectors.DefaultSelector()
        for pipe in self._pipes():
            self._selector.register(pipe, selectors.EVENT_READ)
        return self

    def __exit__(self, *error: object) -> None:
        try:
            if not self._wished_to_end():
                self._signal(signal.SIGKILL)
            self._signal(signal.SIGKILL)  # also those whom the first one left behind
        finally:
            self._process.wait()
            self._selector.close()
            for pipe in self._pipes():
                pipe.close()

    def look(self, timeout_s: float = LOOK_S) -> Said:
        """What it says within ``timeout_s``, at most a piece of each pipe; once it says no more, a wait as long."""
        found = {"out": b"", "error": b""}
        for key, _ in self._selector.select(timeout_s):
            pipe = key.fileobj
            piece = os.read(key.fd, PIECE_BYTES)
            if not piece:
                self._selector.unregister(pipe)
            found["out" if pipe is self._process.stdout else "error"] = piece
        return Said(found["out"], found["error"], not self._selector.get_map())

    @property
    def has_ended(self) -> bool:
        """Whether the program itself has ended. It is not reaped: until then nobody else gets its group's number."""
        flags = os.WEXITED | os.WNOHANG | os.WNOWAIT
        return self._process.returncode is not None or os.waitid(os.P_PID, self._process.pid, flags) is not None

    @property
    def exit_code(self) -> int | None:
        """What it ended with, once the block is left; negative: the signal that ended it."""
        return self._process.returncode

    def _pipes(self) -> list[IO[bytes]]:
        return [pipe for pipe in (self._process.stdout, self._process.stderr) if pipe is not None]

    def _wished_to_end(self) -> bool:
        """Whether it ended after SIGTERM, or before."""
        if self.has_ended:
            return True
        self._signal(signal.SIGTERM)
        deadline_s = time.monotonic() + GRACE_S
        while time.monotonic() < deadline_s:
            if self.has_ended:
                return True
            time.sleep(0.01)
        return False

    def _signal(self, number: int) -> None:
        try:
            os.killpg(self._process.pid, number)
        except (ProcessLookupError, PermissionError):
            return  # nobody is left in it, or only those who have other rights
