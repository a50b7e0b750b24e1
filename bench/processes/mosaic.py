"""Server and robot as a user starts them, in processes of their own."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from mosaic_core.operator import MosaicOperator
from mosaic_core.words.signaling import RobotStatus

MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
START_S = 30.0


@dataclass(frozen=True, slots=True)
class Site:
    """A running server and one robot."""

    url: str
    data_dir: Path
    robot_log: Path
    email: str
    password: str
    robot_id: str


def end_like_ctrl_c() -> None:
    """SIGTERM too must end what was started; in the background of a shell SIGINT is ignored unless asked for."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))


def run_mosaic(*words: str) -> str:
    done = subprocess.run([*MOSAIC, *words], capture_output=True, text=True, timeout=START_S)
    if done.returncode != 0:
        raise SystemExit(f"mosaic {' '.join(words)} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


@contextmanager
def running(log: Path, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """`mosaic …` until the end of the block; its output goes to `log`."""
    with log.open("wb") as output:
        process = subprocess.Popen([*MOSAIC, *words], stdout=output, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def listening_port(ready_file: Path, server: subprocess.Popen[bytes], log: Path) -> int:
    ends_at_s = time.monotonic() + START_S
    while not (ready_file.exists() and ready_file.read_text()):
        if server.poll() is not None or time.monotonic() > ends_at_s:
            raise SystemExit(f"The server did not start:\n{log.read_text()}")
        time.sleep(0.02)
    return int(json.loads(ready_file.read_text())["port"])


async def token_once_ready(site: Site) -> str:
    """Sign in and wait until the robot is online."""
    async with await MosaicOperator.login(site.url, site.email, site.password) as operator:
        try:
            await operator.wait_status(site.robot_id, RobotStatus.READY_TO_CONNECT, START_S)
        except TimeoutError:
            raise SystemExit(f"The robot did not get ready:\n{site.robot_log.read_text()[-4000:]}") from None
        return operator.access_token
