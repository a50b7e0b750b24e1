"""A real coturn on loopback for the tests that probe; skipped where it is not installed."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from support.processes import free_port


@dataclass(frozen=True)
class Coturn:
    """Takes the credentials ``me`` and ``pass``."""

    port: int

    @property
    def udp(self) -> str:
        return f"turn:127.0.0.1:{self.port}"

    @property
    def tcp(self) -> str:
        return f"turn:127.0.0.1:{self.port}?transport=tcp"


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="session")
def coturn(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Coturn]:
    program = shutil.which("turnserver")
    if program is None:
        pytest.skip("no `turnserver`: apt install coturn")
    folder: Path = tmp_path_factory.mktemp("coturn")
    port = free_port()
    words = [program, "-n", "--listening-ip=127.0.0.1", "--relay-ip=127.0.0.1", f"--listening-port={port}"]
    words += ["--lt-cred-mech", "--user=me:pass", "--realm=test", "--no-tls", "--no-dtls", "--allow-loopback-peers"]
    words += ["--no-cli", f"--pidfile={folder / 'pid'}", f"--userdb={folder / 'db'}", "--log-file=stdout"]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT, cwd=folder)
    deadline_s = time.monotonic() + 10
    while not listens(port):
        assert process.poll() is None, (folder / "log").read_text()
        assert time.monotonic() < deadline_s, "coturn does not listen"
        time.sleep(0.05)
    yield Coturn(port)
    process.terminate()
    process.wait(timeout=10)
