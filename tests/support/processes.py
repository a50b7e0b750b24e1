"""Starts programs as processes of their own, reads what they write, and ends them."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from support.waiting import PATIENCE_S, wait_for

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
QUICK_MOSAIC = [sys.executable, str(Path(__file__).with_name("quick_server.py"))]
"""`mosaic` where the words are `server …`, without what hashing passwords costs."""


def run_mosaic(*words: str, **environment: str) -> str:
    """What the command `mosaic …` prints; the test fails with its errors where it does not end well."""
    done = subprocess.run(
        [*MOSAIC, *words], env=os.environ | environment, capture_output=True, text=True, timeout=2 * PATIENCE_S
    )
    assert done.returncode == 0, f"mosaic {' '.join(words)}\n{done.stderr}"
    return done.stdout


def mosaic_here(*words: str, **environment: str) -> str:
    """As :func:`run_mosaic`, in this process: a second and a half quicker where the command is no more than a means."""
    from typer.testing import CliRunner

    from mosaic_core.cli.main import app

    with ThreadPoolExecutor(1) as elsewhere:  # on this thread there may be a loop of Playwright's
        done = elsewhere.submit(CliRunner().invoke, app, words, env=environment).result()
    assert done.exit_code == 0, f"mosaic {' '.join(words)}\n{done.output}"
    return done.stdout


@dataclass
class Process:
    """Runs a program, and keeps what it writes in :attr:`log`. It may be started again when it has ended."""

    words: Sequence[str]
    environment: Mapping[str, str] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)
    process: subprocess.Popen[str] | None = None
    _readers: list[threading.Thread] = field(default_factory=list)

    def start(self) -> None:
        pipe = subprocess.PIPE
        environment = os.environ | self.environment
        self.process = subprocess.Popen(self.words, stdout=pipe, stderr=pipe, text=True, env=environment)
        self._drain(self.process.stdout, self.read_line)
        self._drain(self.process.stderr, self.log.append)

    def read_line(self, line: str) -> None:
        """Take a line of the standard output, on a thread of its own; subclasses may do something else with it."""
        self.log.append(line)

    def expect(self, condition: Callable[[], object], what: str, timeout_s: float = PATIENCE_S) -> float:
        """:func:`wait_for`, for as long as the process lives."""
        return wait_for(condition, what, timeout_s, alive=self.process, log=self.log)

    def stop(self) -> int:
        """SIGTERM, and SIGKILL to what does not end by that; returns the exit code."""
        assert self.process is not None
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self.process.kill()
        return self._ended()

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self._ended()

    def _ended(self) -> int:
        assert self.process is not None
        code = self.process.wait(timeout=5)
        for reader in self._readers:
            reader.join(timeout=5)
        self._readers.clear()
        return code

    def _drain(self, stream: IO[str] | None, take: Callable[[str], None]) -> None:
        assert stream is not None

        def read() -> None:
            with stream:
                for line in stream:
                    take(line.rstrip())

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        self._readers.append(reader)


def free_port() -> int:
    """A TCP port of loopback that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def is_listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
