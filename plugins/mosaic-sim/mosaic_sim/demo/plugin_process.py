"""Runs the process that imports what ``--with`` names: it tells the plugins' trials, then checks a robot's file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.own_plugin import OwnPlugin
from mosaic_sim.demo.server import START_PATIENCE_S
from mosaic_sim.demo.trial_program import TRIALS


class PluginProcess:
    """One for both questions: to import the plugins takes as long as to answer them."""

    def __init__(self, plugins: Sequence[OwnPlugin], process: subprocess.Popen[str]) -> None:
        self._names = ", ".join(one.source for one in plugins)
        self._process = process
        self._is_late = False

    def trials(self) -> Mapping[str, Any]:
        """By type; empty where the process ended, of which the check that follows says why."""
        assert self._process.stdout is not None
        patience = threading.Timer(START_PATIENCE_S, self._give_up)
        patience.start()
        try:
            told = next((line for line in self._process.stdout if line.startswith(TRIALS)), "")
        finally:
            patience.cancel()
        if self._is_late:
            raise self._too_late()
        return dict(json.loads(told.removeprefix(TRIALS))) if told else {}

    def problems(self, file: Path) -> list[Mapping[str, Any]]:
        """What is wrong with the robot's file, as ``mosaic validate --json`` tells it."""
        try:
            said, _ = self._process.communicate(f"{file}\n", timeout=START_PATIENCE_S)
        except subprocess.TimeoutExpired:
            raise self._too_late() from None
        try:
            return list(json.loads(said.splitlines()[-1])["problems"])
        except (IndexError, ValueError, KeyError, TypeError):
            raise DemoFailed(f"{self._names} can't be checked", details=said.strip()[-2000:]) from None

    def _give_up(self) -> None:
        self._is_late = True
        self._process.kill()

    def _too_late(self) -> DemoFailed:
        message = f"the import of {self._names} had not ended after {START_PATIENCE_S:g} s"
        return DemoFailed(message, "open devices in the bodies of handlers: what a module does at its top ends")


@contextmanager
def plugin_process(plugins: Sequence[OwnPlugin], environment: Mapping[str, str]) -> Iterator[PluginProcess]:
    """Ends with the block. What it says of an import that takes long goes to stderr, where people read it."""
    command = [sys.executable, "-m", "mosaic_sim.demo.trial_program", *(one for its in plugins for one in its.types)]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, env={**os.environ, **environment}, stdin=pipe, stdout=pipe, text=True, errors="replace"
    ) as process:
        try:
            yield PluginProcess(plugins, process)
        finally:
            process.kill()
