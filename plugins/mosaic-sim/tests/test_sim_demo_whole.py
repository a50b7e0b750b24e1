"""`mosaic demo` as people run it: real processes, real sockets, real WebRTC on this machine."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.cli.plugin.scaffold import KINDS, NewPlugin
from mosaic_server.security.one_time_codes import LIFETIME_S

pytestmark = pytest.mark.webrtc
COMMAND = [sys.executable, "-m", "mosaic_core.cli.main", "demo", "--port", "0", "--no-open", "--json"]


class Demo:
    """A running `mosaic demo` with a folder for temporary files that the test can look into."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            COMMAND,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "TMPDIR": str(folder)},
        )
        assert self.process.stdout is not None
        self.facts: dict[str, Any] = json.loads(self.process.stdout.readline())

    def ended(self) -> tuple[int, str]:
        """Exit code and what stood on standard error."""
        _, errors = self.process.communicate(timeout=10)
        return self.process.returncode, errors

    def is_running(self, name: str) -> bool:
        try:
            state = Path(f"/proc/{self.facts['pids'][name]}/stat").read_text().rpartition(")")[2].split()[0]
        except FileNotFoundError:
            return False
        return state != "Z"

    def wait_until_children_are_gone(self) -> None:
        deadline_s = time.monotonic() + 5
        while self.is_running("server") or self.is_running("robot"):
            assert time.monotonic() < deadline_s
            time.sleep(0.02)


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[Demo]:
    running = Demo(tmp_path)
    yield running
    with running.process:  # closes the pipes
        running.process.kill()


def test_the_demo_serves_its_page_and_ctrl_c_ends_all_and_leaves_nothing(demo: Demo) -> None:
    assert demo.facts["ok"]
    assert demo.facts["page"].startswith(f"{demo.facts['url']}/robots/{demo.facts['robotId']}#code=")
    expires_at = datetime.fromisoformat(demo.facts["pageExpiresAt"])
    assert datetime.now(UTC) < expires_at <= datetime.now(UTC) + timedelta(seconds=LIFETIME_S)
    with urllib.request.urlopen(f"{demo.facts['url']}/healthz", timeout=5) as answer:
        assert json.load(answer) == {"status": "ok"}
    assert list(demo.folder.iterdir())
    began_s = time.monotonic()
    demo.process.send_signal(signal.SIGINT)
    code, errors = demo.ended()
    assert (code, errors) == (0, "")
    assert time.monotonic() - began_s < 3.0, "2 s, and what a busy machine takes to end three interpreters"
    assert not list(demo.folder.iterdir())
    assert not demo.is_running("server")
    assert not demo.is_running("robot")


@pytest.mark.parametrize(("victim", "survivor"), [("robot", "server"), ("server", "robot")])
def test_a_child_that_dies_ends_the_demo_with_its_name(demo: Demo, victim: str, survivor: str) -> None:
    os.kill(demo.facts["pids"][victim], signal.SIGKILL)
    code, errors = demo.ended()
    assert code == 1
    assert f"the {victim} ended with exit code -9" in errors
    assert not demo.is_running(survivor)
    assert not list(demo.folder.iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells children of a parent's sudden death")
def test_children_do_not_outlive_a_killed_demo(demo: Demo) -> None:
    demo.process.kill()
    demo.wait_until_children_are_gone()


def test_the_headless_check_drives_the_robot_and_finds_everything_in_order_also_what_one_has_brought(
    tmp_path: Path,
) -> None:
    brought: list[str] = []
    for kind in KINDS:
        NewPlugin(f"acme-{kind}", kind).write(tmp_path / kind)
        brought += ["--with", str(tmp_path / kind)]
    done = subprocess.run(
        [*COMMAND, "--headless-check", *brought], capture_output=True, text=True, check=False, timeout=110
    )
    report = json.loads(done.stdout)
    assert [check for check in report["checks"] if not check["ok"]] == []
    names = {check["name"] for check in report["checks"]}
    assert {"connect", "pictures", "lease", "drive", "silence stops", *(f"acme_{kind}" for kind in KINDS)} <= names
    assert done.returncode == 0
