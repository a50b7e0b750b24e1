"""`mosaic run` as a process whose plugins misbehave: what blocks the event loop is named, and every robot ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mosaic_core.testing.distributions import write_distribution

ACME = """
import asyncio, time
from pathlib import Path
from mosaic_core import DataChannelConfigurer, DataChannelJsonReceivable, DataChannelSendable, NoParams, Params


class Asleep(DataChannelSendable[str]):
    async def messages(self):
        yield "one"
        time.sleep(3600)  # the line to blame


class Stubborn(DataChannelSendable[str]):
    async def messages(self):
        yield "one"
        while True:
            try:
                await asyncio.sleep(3600)
            except asyncio.CancelledError:
                pass


class Interrupted(DataChannelSendable[str]):
    def messages(self):
        yield "one"
        raise KeyboardInterrupt


class Base(DataChannelJsonReceivable):
    timeout_s = 1.0

    def __init__(self, label, told):
        super().__init__(label)
        self.told = told

    def handle_data(self, data):
        pass

    def make_safe(self, cause):
        self.told.write_text(cause)


class BaseParams(Params):
    told: Path


class BaseConfigurer(DataChannelConfigurer[BaseParams]):
    connector_type = "acme-base"

    def configure(self):
        return Base(self.label, self.params.told)


def made(body):
    class Made(DataChannelConfigurer[NoParams]):
        connector_type = f"acme-{body.__name__.lower()}"

        def configure(self):
            return body(self.label)
    return Made


AsleepConfigurer, StubbornConfigurer, InterruptedConfigurer = map(made, (Asleep, Stubborn, Interrupted))
"""
CONFIG = """\
version: 1
server:
  ws_url: ws://127.0.0.1:9
  auth: { type: no-authorization, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11 }
connectors:
"""
LINE = ACME.splitlines().index("        time.sleep(3600)  # the line to blame") + 1


class Run:
    """A robot with connectors of Acme. ``log``: what it has told so far; ``rows``: the newest of each connector."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.log: list[dict[str, Any]] = []
        self.rows: dict[str, Any] = {}
        self._readers = [threading.Thread(target=read) for read in (self._read_log, self._read_rows)]
        for reader in self._readers:
            reader.start()

    def close(self) -> None:
        self.process.kill()
        self.process.wait(timeout=5)
        for reader in self._readers:
            reader.join()
        for pipe in (self.process.stdout, self.process.stderr):
            assert pipe is not None
            pipe.close()

    def _read_log(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.log.append(json.loads(line))

    def _read_rows(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.rows = {row["label"]: row for row in json.loads(line)["connectors"]}

    def told(self, code: str) -> dict[str, Any] | None:
        return next((entry for entry in self.log if entry.get("code") == code), None)

    def wait_for(self, predicate: Any, what: str) -> None:
        end_s = time.monotonic() + 30
        while not predicate():
            assert self.process.poll() is None, f"it ended before {what}"
            assert time.monotonic() < end_s, what
            time.sleep(0.02)

    def ended_within(self, limit_s: float) -> int:
        begun_s = time.monotonic()
        code = self.process.wait(timeout=30)
        assert time.monotonic() - begun_s < limit_s
        return code


@contextmanager
def running(folder: Path, *connectors: str) -> Iterator[Run]:
    names = {
        "acme-asleep": "Asleep",
        "acme-stubborn": "Stubborn",
        "acme-interrupted": "Interrupted",
        "acme-base": "Base",
    }
    points = {"mosaic.connectors": {name: f"acme:{made}Configurer" for name, made in names.items()}}
    write_distribution(folder, "acme", modules={"acme": ACME}, entry_points=points)
    config = folder / "robot.yaml"
    config.write_text(CONFIG + "".join(f"  - {{ {words} }}\n" for words in connectors))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    process = subprocess.Popen(
        [sys.executable, "-m", "mosaic_core.cli.main", "run", str(config), "--json", "--log-format", "json"],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    run = Run(process)
    try:
        yield run
    finally:
        run.close()


def test_who_blocks_the_loop_is_named_and_a_second_ctrl_c_ends_it_at_once_safe_actions_first(tmp_path: Path) -> None:
    told = tmp_path / "told"
    base = f"type: acme-base, label: base, params: {{ told: {told} }}"
    with running(tmp_path, base, "type: acme-asleep, label: dozy") as run:
        run.wait_for(lambda: run.told("plugin.blocks_loop"), "the guard names who blocks the loop")
        blamed = run.told("plugin.blocks_loop")
        assert blamed is not None
        assert blamed["label"] == "dozy"
        assert f"acme.py:{LINE} in Asleep.messages" in blamed["message"]
        run.process.send_signal(signal.SIGINT)
        run.wait_for(lambda: any("ends it at once" in entry["message"] for entry in run.log), "it heard the first")
        run.process.send_signal(signal.SIGINT)
        assert run.ended_within(1.5) == 130
    assert told.read_text() == "safety.shutdown"


def test_a_body_that_swallows_its_cancellation_keeps_no_robot_from_ending(tmp_path: Path) -> None:
    with running(tmp_path, "type: acme-stubborn, label: mule") as run:
        run.wait_for(lambda: run.rows.get("mule", {}).get("state") == "running", "its body runs")
        run.process.send_signal(signal.SIGTERM)
        assert run.ended_within(3.0) == 0
        ignored = run.told("plugin.ignored_stop")
        assert ignored is not None
        assert ignored["label"] == "mule"


def test_a_keyboard_interrupt_in_a_body_is_a_failure_like_any_other(tmp_path: Path) -> None:
    with running(tmp_path, "type: acme-interrupted, label: quits") as run:
        run.wait_for(lambda: run.rows.get("quits", {}).get("state") == "failed", "it counts as failed")
        run.wait_for(lambda: run.rows["quits"]["failures"] > 1, "it is started again")
        assert "KeyboardInterrupt" in run.rows["quits"]["last_error"]
