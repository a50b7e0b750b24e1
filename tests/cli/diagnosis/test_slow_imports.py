"""An import that hangs is named by the commands that keep the log to themselves, and Ctrl-C ends it."""

from __future__ import annotations

import logging
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.runtime.threads import slow_code
from mosaic_core.testing.pytest_plugin import InstallDistribution

SLOW = """
import threading
from mosaic_core import DataChannelConfigurer, DataChannelReceivable, NoParams

threading.Event().wait(0.5)

class Lamp(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None: ...

class LampConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "acme-lamp"
    def configure(self) -> Lamp:
        return Lamp(self.label)
"""
INTERRUPTED = "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(20)\n"


@pytest.fixture
def install(install_distribution: InstallDistribution) -> Callable[[str], Path]:
    points = {"mosaic.connectors": {"acme-lamp": "acme_lamp:LampConfigurer"}}
    return lambda source: install_distribution("acme-lamp", modules={"acme_lamp": source}, entry_points=points)


@pytest.fixture
def _log_as_it_was() -> Any:
    handlers, level = [*logging.root.handlers], logging.root.level
    yield
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)


@pytest.mark.usefixtures("_log_as_it_was")
@pytest.mark.parametrize(
    ("words", "of"),
    [
        (("plugin", "check", "acme-lamp"), ""),
        (("doctor", "robot.yaml", "--only", "config"), " of acme-lamp 1.0.0"),
    ],
)
def test_it_is_told_with_its_line(
    mosaic: Callable[..., Any],
    install: Callable[[str], Path],
    robot_yaml: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    of: str,
) -> None:
    folder = install(SLOW)
    monkeypatch.setattr(slow_code, "PATIENCE_S", 0.05)
    robot_yaml.write_text(robot_yaml.read_text() + "  - { type: acme-lamp, label: lamp }\n")
    ended = mosaic(*(str(robot_yaml) if word == "robot.yaml" else word for word in words))
    told = f"the import of connector type 'acme-lamp'{of} goes on for 0.05 s already, at {folder}/acme_lamp.py:5; "
    assert told + "Ctrl-C ends the wait\n" in ended.err


@pytest.mark.usefixtures("_log_as_it_was")
@pytest.mark.parametrize("words", [("plugin", "check", "acme-lamp"), ("doctor", "robot.yaml")])
def test_the_first_ctrl_c_ends_it(
    mosaic: Callable[..., Any], install: Callable[[str], Path], robot_yaml: Path, words: tuple[str, ...]
) -> None:
    install(INTERRUPTED)
    robot_yaml.write_text(robot_yaml.read_text() + "  - { type: acme-lamp, label: lamp }\n")
    before = signal.getsignal(signal.SIGINT)
    ended = mosaic(*(str(robot_yaml) if word == "robot.yaml" else word for word in words))
    assert (ended.code, signal.getsignal(signal.SIGINT)) == (130, before)
