"""`mosaic plugin new` writes packages that are green from their first second, and refuses what it can't write."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest
import yaml

from mosaic_core.cli.plugin import scaffold
from mosaic_core.cli.plugin.scaffold import KINDS, NewPlugin
from mosaic_core.runtime.widgets.widget_modules import exports_of
from mosaic_core.testing import build
from mosaic_core.testing.distributions import forget_modules_of, write_distribution
from mosaic_core.words.errors import MosaicError
from release.wheels import PYTHONS

ROOT = Path(__file__).parents[3]
CACHE = ROOT / ".mypy_cache" / "new_plugins"
LONGEST = "acme-a-name-as-long-as-it-may-be"


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a new plugin of each kind, each installed as far as its metadata goes."""
    folder = tmp_path_factory.mktemp("new")
    for kind in KINDS:
        NewPlugin(f"acme-{kind}", kind).write(folder / f"acme-{kind}")
        project = tomllib.loads((folder / f"acme-{kind}" / "pyproject.toml").read_text())["project"]
        write_distribution(folder / "installed", project["name"], entry_points=project["entry-points"])
    return folder


def checked(packages: Path, kind: str, *words: str) -> str:
    """What a command in the folder of a new plugin prints; it must end well."""
    own = [packages / "installed", packages / f"acme-{kind}"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, own))}
    command = [sys.executable, "-m", *words]
    done = subprocess.run(command, cwd=own[1], env=environment, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("kind", KINDS)
def test_the_tests_of_a_new_plugin_pass(packages: Path, kind: str) -> None:
    assert " passed" in checked(packages, kind, "pytest", "-q", "-p", "no:cacheprovider")


@pytest.mark.parametrize("kind", KINDS)
def test_the_example_of_a_new_plugin_is_valid(packages: Path, kind: str) -> None:
    told = checked(packages, kind, "mosaic_core.cli.main", "validate", "--allow-missing-env")
    assert told == "mosaic_config.yaml: valid\n"


TYPED_TEST = """from collections.abc import Iterator

import numpy as np
from mosaic_core import MediaTrackConfigurer, MediaTrackHandler, NoParams
from mosaic_core.testing import build, take_frames
from numpy.typing import NDArray


class Eye(MediaTrackHandler):
    def frames(self) -> Iterator[NDArray[np.uint8]]:
        yield np.zeros((2, 2, 3), np.uint8)


class EyeConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "eye"

    def configure(self) -> Eye:
        return Eye(self.label)


def test_its_size() -> None:
    (picture,) = take_frames(build(EyeConfigurer), 1)
    assert picture.shape == (2, 2, 3)


def count(camera: MediaTrackHandler) -> int:
    return len(take_frames(camera))
"""


def test_new_plugins_and_what_the_kit_takes_of_a_camera_are_typed_strictly(packages: Path, tmp_path: Path) -> None:
    """All kinds at once: most of the time goes into what they import."""
    folders = [str(packages / f"acme-{kind}" / f"acme_{kind}") for kind in KINDS]
    (tmp_path / "test_eye.py").write_text(TYPED_TEST)
    folders += [str(tmp_path / "test_eye.py"), str(packages / "acme-camera" / "tests" / "test_connector.py")]
    assert "no issues" in checked(packages, "sensor", "mypy", "--strict", "--cache-dir", str(CACHE), *folders)


def test_its_workflow_runs_everything_on_every_python_with_the_actions_that_we_use() -> None:
    text = NewPlugin("acme-lamp", "sensor").files()[Path(".github/workflows/check.yml")]
    (job,) = yaml.safe_load(text)["jobs"].values()
    assert job["strategy"]["matrix"]["python"] == [f"{major}.{minor}" for major, minor in PYTHONS]
    ours = "".join(file.read_text("utf-8") for file in (ROOT / ".github" / "workflows").glob("*.yml"))
    used = [step["uses"] for step in job["steps"] if "uses" in step]
    assert used
    assert [action for action in used if f"uses: {action}\n" not in ours] == []
    runs = [step["run"] for step in job["steps"] if "run" in step]
    assert {"pytest", "mypy acme_lamp", "mosaic plugin check . --level gold"} <= set(runs)


@pytest.mark.parametrize("name", ["acme-lamp", "iterator", LONGEST])
@pytest.mark.parametrize("kind", KINDS)
def test_new_plugins_are_formatted_and_without_a_lint(tmp_path: Path, kind: str, name: str) -> None:
    NewPlugin(name, kind).write(tmp_path / name)
    for words in (["check"], ["format", "--check"]):
        done = subprocess.run([sys.executable, "-m", "ruff", *words, "--no-cache", tmp_path], capture_output=True)
        assert done.returncode == 0, done.stdout.decode()


@pytest.mark.parametrize("kind", KINDS)
def test_the_command_writes_a_folder_once(
    mosaic: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = mosaic("plugin", "new", "acme-lamp", f"--{kind}")
    assert (ended.code, ended.out.splitlines()[0]) == (0, "wrote acme-lamp/; next:")
    text = (tmp_path / "acme-lamp" / "acme_lamp" / "connector.py").read_text()
    assert "$" not in text
    (tmp_path / "acme-lamp" / "acme_lamp" / "connector.py").write_text("mine")
    again = mosaic("plugin", "new", "acme-lamp", f"--{kind}")
    assert "acme-lamp is there already" in again.err
    assert (again.code, (tmp_path / "acme-lamp" / "acme_lamp" / "connector.py").read_text()) == (2, "mine")


@pytest.mark.parametrize("kinds", [[], ["--sensor", "--camera"]])
def test_one_kind_is_wanted(mosaic: Callable[..., Any], kinds: list[str]) -> None:
    ended = mosaic("plugin", "new", "acme-lamp", *kinds)
    assert ended.code == 2
    assert f"say one of {', '.join(f'--{kind}' for kind in KINDS)}" in ended.err


def test_a_type_that_is_installed_is_refused(mosaic: Callable[..., Any]) -> None:
    ended = mosaic("plugin", "new", "connection-check", "--sensor")
    assert ended.code == 2
    assert "has the type 'connection-check' already; choose another name" in ended.err


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MosaicError, match="acme-lamp can't be written: Not a directory"):
        NewPlugin("acme-lamp", "sensor").write(tmp_path / "file" / "acme-lamp")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Acme", "'Acme' is no name for a plugin"),
        ("../acme", "'../acme' is no name for a plugin"),
        ("acme_lamp", "'acme_lamp' is no name for a plugin"),
        (f"{LONGEST}x", "is no name for a plugin"),
        ("json", "a module 'json' is there already"),
        ("class", "a module 'class' is there already"),
        ("mosaic-core", "a module 'mosaic_core' is there already"),
        ("conftest", "'conftest' is the name of its own tests"),
        ("test-connector", "'test_connector' is the name of its own tests"),
    ],
)
def test_a_name_that_cannot_be_is_refused(name: str, message: str) -> None:
    with pytest.raises(MosaicError) as caught:
        NewPlugin(name, "sensor")
    assert message in caught.value.message
    assert caught.value.code == "plugin.name"


@pytest.mark.parametrize(
    ("name", "like"),
    [("acme-1", "acme1"), ("Acme_Lamp", "acme-lamp"), ("1", "acme-thermometer"), (f"{LONGEST}x", "acme-thermometer")],
)
def test_a_refused_name_comes_with_one_that_can_be(mosaic: Callable[..., Any], name: str, like: str) -> None:
    ended = mosaic("plugin", "new", name, "--sensor")
    assert ended.code == 2
    assert ended.err == (
        f"error: '{name}' is no name for a plugin\n  code: plugin.name\n  cure: use words of small letters and digits "
        f"that begin with a letter, joined by -, at most 32 characters, such as {like}\n"
    )
    assert NewPlugin(like, "sensor").name == like


NASTY = [
    "iterator", "any", "class-var", "field", "params", "message", "unit", "device", "made-up-line", "captured",
    "data-channel", "media-track", "encoding", "request", "request-handler", "refused", "delivery", "shared", "keeper",
    "device-gone", "self", "none", "true", "false", "exception", "value-error", "type", "object", "np", "config-error",
    "path", "silence", "leaves", "made-safe", "connector", "speed", "average", "yes", "null", "stand-in", "mosaic-any",
]  # fmt: skip
"""Words that modules of a new plugin, Python or YAML mean otherwise."""


@pytest.mark.parametrize("kind", KINDS)
def test_no_name_hides_what_its_modules_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """The connectors of each are made, of each of its modules."""
    monkeypatch.setattr(scaffold, "find_spec", lambda name: None)  # a folder of other tests may have this name
    for name in NASTY:
        new = NewPlugin(name, kind)
        new.write(tmp_path / name)
        config = yaml.safe_load((tmp_path / name / "mosaic_config.yaml").read_text())
        assert [one["type"] for one in config["connectors"]] == [*new.connector_types]
        project = tomllib.loads((tmp_path / name / "pyproject.toml").read_text())["project"]
        monkeypatch.syspath_prepend(tmp_path / name)
        for type_, value in project["entry-points"]["mosaic.connectors"].items():
            configurer = EntryPoint(type_, value, "mosaic.connectors").load()
            build(configurer)
            assert configurer.connector_type == type_
        forget_modules_of(tmp_path / name)
        for file in (tmp_path / name / "tests").glob("*.py"):
            assert hidden_in(file.read_text()) == set()


def hidden_in(text: str) -> set[str]:
    """The names that a module imports twice."""
    nodes = [node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom)]
    names = [alias.name for node in nodes for alias in node.names]
    return {name for name in names if names.count(name) > 1}


def test_the_type_of_our_own_plugins_goes_without_our_name() -> None:
    new = NewPlugin("mosaic-lift", "actuator")
    assert (new.module, new.connector_type) == ("mosaic_lift", "lift")


def test_a_full_plugin_has_a_type_for_each_connector_and_a_widget_without_a_build() -> None:
    new = NewPlugin("acme-arm", "full")
    assert new.connector_types == ("acme-arm", "acme-arm-speed", "acme-arm-average")
    text = new.files()[Path("acme_arm/widgets/acme-arm.js")]
    assert exports_of(text) == {"apiVersion", "Panel"}
    assert set(re.findall(r"from '([^']+)'", text)) == {"react", "@mosaic/widgets"}
