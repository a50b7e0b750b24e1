"""A command ends with its code, whatever threads the import of a plugin left running."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mosaic_core.testing.distributions import write_distribution

SOURCE = """
import threading

def wait_for_ever():
    threading.Event().wait()

threading.Thread(target=wait_for_ever, name="acme-sdk").start()
threading.Thread(target=int, name="short").start()

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, NoParams

class Lamp(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None: ...

class LampConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "acme-lamp"
    def configure(self) -> Lamp:
        return Lamp(self.label)
"""
ROBOT = """\
version: 1
server:
  ws_url: ws://127.0.0.1:9
  auth: {{ type: no-authorization, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11 }}
connectors:
  - {{ type: acme-lamp, label: lamp{more} }}
"""


def ended(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    points = {"mosaic.connectors": {"acme-lamp": "acme:LampConfigurer"}}
    write_distribution(folder, "acme", modules={"acme": SOURCE}, entry_points=points)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", "mosaic_core.cli.main", *words]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=40)


@pytest.mark.parametrize(
    ("words", "more", "code", "out"),
    [
        (("validate", "robot.yaml"), "", 0, "robot.yaml: valid\n"),
        (("validate", "robot.yaml"), ", lable: x", 2, ""),
        (("plugin", "check", "acme-lamp"), "", 1, "below bronze"),
    ],
)
def test_a_command_ends_with_its_code_and_tells_whose_threads_go_on(
    tmp_path: Path, words: tuple[str, ...], more: str, code: int, out: str
) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT.format(more=more))
    done = ended(tmp_path, *(word.replace("robot.yaml", str(tmp_path / "robot.yaml")) for word in words))
    assert (done.returncode, out in done.stdout) == (code, True), done
    told = (
        "ended without waiting for what plugins left running: thread 'acme-sdk' at "
        f"{tmp_path}/acme.py:5 in wait_for_ever; start such threads with daemon=True, and in the body of a handler "
        "instead of an import\n"
    )
    assert done.stderr.endswith(told)
