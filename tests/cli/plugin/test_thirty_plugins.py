"""Thirty plugins and more, many of them broken, each in its own way: each is told with its distribution, file and line,
and breaks nobody else."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.cli.configuration.broken_types import PATIENCE_S
from mosaic_core.testing.distributions import write_distribution

PREFIX = "acme"
GOOD = '''from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, NoParams

class Beat(Message):
    count: int

class Heart(DataChannelSendable[Beat]):
    def messages(self):
        for count in self.every(0.05):
            yield Beat(count=count)

class Configurer(DataChannelConfigurer[NoParams]):
    """Beats."""
    connector_type = "TYPE"
    def configure(self):
        return Heart(self.label)
'''
BROKEN: dict[str, tuple[str, str, int, str]] = {
    "import": (
        "from mosaic_core import",
        "from mosaic_coree import",
        1,
        "needs 'mosaic_coree', which is not installed",
    ),
    "syntax": ("class Beat(Message):", "class Beat(Message:", 3, "SyntaxError"),
    "class": (
        "class Configurer(DataChannelConfigurer[NoParams]):",
        "class Configurer:",
        11,
        "is not a Configurer class",
    ),
    "type": ('connector_type = "TYPE"', 'connector_type = "other"', 11, "says that its connector_type is 'other'"),
    "untyped": ('    connector_type = "TYPE"\n', "", 11, "Configurer has no connector_type"),
    "word": ("    def configure", "    exmple = {}\n    def configure", 11, "did you mean 'example'?"),
    "value": ("    def messages", "    runs = 'now'\n    def messages", 6, "runs is 'now', and no time to run"),
    "version": (
        "class Beat(Message):",
        "MOSAIC_API_VERSION = 9\nclass Beat(Message):",
        12,
        "written for API version 9",
    ),
    "params": ("[NoParams]", "[dict]", 11, "its params are dict, which is not derived from Params"),
    "leaves": ("class Beat(Message):", "import sys\nsys.exit(3)\nclass Beat(Message):", 4, "SystemExit: 3"),
    "speechless": (
        "class Beat(Message):",
        "class Odd(Exception):\n    def __str__(self):\n        return 1 / 0\nraise Odd\nclass Beat(Message):",
        6,
        "Odd: it can't say what happened, for its __str__ raises ZeroDivisionError",
    ),
    "declares": ("    count: int", "    count: int = 'none'\n    count_hz: undefined", 5, "NameError"),
    "configure": ("return Heart(self.label)", "return Heart(self.lable)", 15, "has no attribute 'lable'"),
    "init": (
        "    def messages(self):",
        "    def __init__(self, label):\n        raise KeyError('odd')\n    def messages(self):",
        8,
        "KeyError: 'odd'",
    ),
    "nolabel": (
        "    def messages(self):",
        "    def __init__(self, label):\n        pass\n    def messages(self):",
        6,
        "its handler has no label",
    ),
    "samelabel": (
        "return Heart(self.label)",
        "return [Heart(self.label), Heart(self.label)]",
        14,
        "makes two handlers of one label 'l",
    ),
}
"""Told by `validate`, and so by `run`: what stands there, what is written instead, the line of it, what is said."""
MISLED = {
    "nomodule": ("acme_nowhere:Configurer", "its entry point names the module 'acme_nowhere', which is not installed"),
    "noclass": ("acme_noclass:Configurator", "its entry point names 'Configurator', which"),
    "noname": ("acme_noname", "is not a Configurer class"),
    "nowords": ("acme_nowords Configurer", "its entry point is 'acme_nowords Configurer', which is no module:Class"),
}
"""Sound code, and an entry point that leads elsewhere: what it names, what is said."""
LATE = frozenset({"configure", "init", "nolabel", "samelabel"})
"""Broken in what a list does not look at: it makes no handler."""
RAISES = GOOD.replace("        for count", '        raise RuntimeError("no such thing")\n        for count')
DEAF = GOOD.replace(
    "        for count in self.every(0.05):\n            yield Beat(count=count)",
    "        import time\n        while True:\n            yield Beat(count=1)\n            time.sleep(30)",
)
ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
SERVER = f"server: {{ ws_url: 'ws://127.0.0.1:9', auth: {{ type: no-authorization, robot_id: {ROBOT_ID} }} }}"


ENDLESS = GOOD.replace("class Beat(", "import threading\nthreading.Event().wait()\n\nclass Beat(")
CRASHES = GOOD.replace("class Beat(", "import os\nos.abort()\n\nclass Beat(")


def install(folder: Path, name: str, source: str, connector_type: str = "", names: str = "") -> None:
    kind = connector_type or f"{PREFIX}-{name}"
    module = f"{PREFIX}_{name}"
    write_distribution(
        folder,
        f"{PREFIX}-{name}",
        modules={module: source.replace("TYPE", kind)},
        entry_points={"mosaic.connectors": {kind: names or f"{module}:Configurer"}},
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where they are installed."""
    folder = tmp_path_factory.mktemp("site-packages")
    for number in range(17):
        install(folder, f"good{number}", GOOD)
    for name, (old, new, _, _) in BROKEN.items():
        assert old in GOOD
        install(folder, name, GOOD.replace(old, new))
    for name, (names, _) in MISLED.items():
        install(folder, name, GOOD, names=names)
    install(folder, "raises", RAISES)
    install(folder, "deaf", DEAF)
    install(folder, "endless", ENDLESS)
    install(folder, "crashes", CRASHES)
    install(folder, "twin", GOOD, "acme-good0")
    return folder


@pytest.fixture
def mosaic(site: Path, tmp_path: Path) -> Iterator[Any]:
    processes: list[subprocess.Popen[str]] = []

    def start(*words: str) -> subprocess.Popen[str]:
        code = f"import sys; sys.path.insert(0, {str(site)!r}); from mosaic_core.cli.main import main; main()"
        command = [sys.executable, "-c", code, *words]
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate(timeout=10)


def write_robot(folder: Path, *types: str) -> None:
    lines = [f"  - {{ type: {kind}, label: l{number} }}" for number, kind in enumerate(types)]
    (folder / "mosaic_config.yaml").write_text("\n".join([SERVER, "connectors:", *lines, ""]))


COUNT = 17 + len(BROKEN) + len(MISLED) + 5


def test_the_list_has_all_imports_none_and_marks_what_two_have(mosaic: Any, site: Path) -> None:
    out, err = mosaic("connectors", "list", "--json").communicate(timeout=60)
    ours = [one for one in json.loads(out) if one["distribution"].startswith(PREFIX)]
    assert len(ours) == COUNT
    assert {one["type"] for one in ours if "broken" in one} == {"acme-good0"}
    assert err == ""
    assert not list(site.glob("**/*.pyc"))


def test_a_checked_list_marks_what_can_not_be_used_and_nothing_else(mosaic: Any, site: Path) -> None:
    out, err = mosaic("connectors", "list", "--check", "--json").communicate(timeout=100)
    broken = {one["type"]: one["broken"] for one in json.loads(out) if "broken" in one}
    assert err == ""
    for name, (_, _, line, told) in BROKEN.items():
        if name not in LATE:
            said = broken.pop(f"{PREFIX}-{name}")
            assert told in said
            assert f"{site}/{PREFIX}_{name}.py:{line}" in said
    for name, (_, told) in MISLED.items():
        assert told in broken.pop(f"{PREFIX}-{name}")
    endless, crashes = broken.pop("acme-endless"), broken.pop("acme-crashes")
    assert (endless, crashes) == (
        f"its import had not ended after {PATIENCE_S:g} s ({site}/acme_endless.py:4)",
        f"its import ends the whole process: SIGABRT ({site}/acme_crashes.py:4)",
    )
    assert "claimed by acme-good0 1.0.0 and acme-twin 1.0.0" in broken.pop("acme-good0")
    assert broken == {}


def test_validate_names_distribution_file_and_line_of_each(mosaic: Any, site: Path, tmp_path: Path) -> None:
    write_robot(tmp_path, *(f"{PREFIX}-{name}" for name in (*BROKEN, *MISLED)), "acme-good0", "acme-good1")
    done = mosaic("validate")
    _, err = done.communicate(timeout=60)
    assert done.returncode == 2
    for name, (_, _, line, told) in BROKEN.items():
        said, arrow = next(pair for pair in pairwise(err.splitlines()) if f"{PREFIX}-{name} 1.0.0" in pair[0])
        assert told in said
        assert arrow.startswith(f"  --> {site}/{PREFIX}_{name}.py:{line}  [")
    for name, (_, told) in MISLED.items():
        assert told in next(one for one in err.splitlines() if f"{PREFIX}-{name} 1.0.0" in one)
    assert "did you mean 'Configurer'?" in err
    assert "claimed by acme-good0 1.0.0 and acme-twin 1.0.0" in err
    assert err.count("error: ") == len(BROKEN) + len(MISLED) + 1
    assert "Traceback" not in err


@pytest.mark.parametrize("words", [("validate",), ("run",)])
def test_an_import_that_never_ends_is_named_with_its_line(
    mosaic: Any, site: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    write_robot(tmp_path, "acme-good1", "acme-endless")
    waiting = mosaic(*words)
    told = next(line for line in waiting.stderr if "acme-endless" in line)
    assert "the import of connector type 'acme-endless' of acme-endless 1.0.0 goes on for 4 s already" in told
    assert f"{site}/acme_endless.py:4;" in told


def test_run_goes_on_beside_bodies_that_break_and_says_which(mosaic: Any, site: Path, tmp_path: Path) -> None:
    write_robot(tmp_path, "acme-raises", "acme-deaf", "acme-good1")
    running = mosaic("run", "--json")
    for line in running.stdout:
        rows = {row["type"]: row for row in json.loads(line)["connectors"]}
        if rows and rows["acme-good1"]["messages"] > 20 and rows["acme-raises"]["failures"]:
            break
    assert rows["acme-raises"]["state"] == "failed"
    assert rows["acme-good1"]["failures"] == 0
    running.terminate()
    _, err = running.communicate(timeout=10)
    assert running.returncode == 0
    assert re.search(rf"'l0' failed at {re.escape(str(site))}/acme_raises\.py:8 .*no such thing", err)
    told = r"'l1' did not stop within 1\.5 s and was abandoned \(plugin\.ignored_stop\); it is at "
    assert re.search(rf"{told}{re.escape(str(site))}/acme_deaf\.py:\d+ in \w+\.messages", err)


def test_a_broken_plugin_that_nobody_uses_breaks_nothing(mosaic: Any, tmp_path: Path) -> None:
    write_robot(tmp_path, "acme-good1", "acme-good2")
    done = mosaic("validate")
    out, err = done.communicate(timeout=60)
    assert (done.returncode, err) == (0, ""), out
