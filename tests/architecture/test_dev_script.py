"""The two commands: `./dev` answers before it installs anything, and needs only the standard library."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
import threading
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

DEV = Path(__file__).parents[2] / "dev"


@pytest.fixture(scope="module")
def dev() -> ModuleType:
    loader = SourceFileLoader("dev_script", str(DEV))
    spec = importlib.util.spec_from_loader("dev_script", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    dont_write = sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    sys.dont_write_bytecode = dont_write
    return module


def test_it_imports_the_standard_library_only() -> None:
    names = {
        alias.name.split(".")[0]
        for node in ast.walk(ast.parse(DEV.read_text()))
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    assert names <= sys.stdlib_module_names


@pytest.mark.parametrize(("words", "code"), [([], 2), (["nonsense"], 2), (["--help"], 0), (["demo", "test"], 2)])
def test_wrong_words_show_the_usage_and_do_nothing(words: list[str], code: int) -> None:
    done = subprocess.run([sys.executable, str(DEV), *words], capture_output=True, text=True)
    assert done.returncode == code
    assert "./dev demo" in done.stdout


def test_words_after_two_dashes_go_to_what_is_run(dev: ModuleType) -> None:
    assert dev._split(["demo", "--", "--port", "9"]) == (["demo"], "--", ["--port", "9"])
    assert dev._split(["test"]) == (["test"], "--", [])


@pytest.mark.parametrize(
    ("printed", "enough"),
    [("v20.19.0", True), ("v24.1.0", True), ("v20.9.9", False), ("v18.20.0", False), ("?", False)],
)
def test_an_old_node_counts_as_absent(dev: ModuleType, tmp_path: Path, printed: str, enough: bool) -> None:
    node = tmp_path / "node"
    node.write_text(f"#!/bin/sh\necho {printed}\n")
    node.chmod(0o755)
    assert dev._is_new_enough(str(node), ">=20.19") is enough


def test_the_dashboards_packages_are_installed_beside_those_of_python(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = threading.Barrier(2, timeout=30)
    monkeypatch.setattr(dev, "_found_node", lambda: "/usr/bin/node")
    monkeypatch.setattr(dev, "install_packages", lambda node: both.wait())
    monkeypatch.setattr(dev, "install_python", both.wait)
    assert dev.install() == Path("/usr/bin/node")


def test_without_a_node_python_brings_one_before_the_dashboards_packages(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    monkeypatch.setattr(dev, "_found_node", lambda: None)
    monkeypatch.setattr(dev, "install_python", lambda: done.append("python"))
    monkeypatch.setattr(dev, "install_node", lambda: "/its/own/node")
    monkeypatch.setattr(dev, "install_packages", done.append)
    assert dev.install() == Path("/its/own/node")
    assert done == ["python", "/its/own/node"]


def installing(dev: ModuleType, monkeypatch: pytest.MonkeyPatch, venv: Path, checked: str = "") -> list[list[str]]:
    """The commands by which `install_python` fills an environment that is there already."""
    (venv / "bin").mkdir(parents=True, exist_ok=True)
    (venv / "bin" / "python").touch()
    commands: list[list[str]] = []
    monkeypatch.setattr(dev, "VENV", venv)
    monkeypatch.setattr(dev, "PYTHON", venv / "bin" / "python")
    monkeypatch.setattr(dev, "_must", lambda command: commands.append([str(word) for word in command]))
    answer = subprocess.CompletedProcess([], 0, stdout=checked)
    monkeypatch.setattr(dev, "subprocess", SimpleNamespace(run=lambda *_, **__: answer))
    dev.install_python()
    return commands


def test_others_are_installed_by_hash_and_ours_from_here_without_asking_anybody(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    *locked, ours = installing(dev, monkeypatch, tmp_path)
    for words in locked:
        assert "--require-hashes" in words
        assert Path(words[-1]).parent == DEV.parent / "locks"
    assert "--no-deps" in ours
    assert "--no-build-isolation" in ours
    sources = [ours[place + 1] for place, word in enumerate(ours) if word == "--editable"]
    assert all(Path(source, "pyproject.toml").is_file() for source in sources)
    assert sources[0] == str(DEV.parent)


def test_nothing_is_installed_again_until_a_lock_or_a_pyproject_changes(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert installing(dev, monkeypatch, tmp_path)
    assert installing(dev, monkeypatch, tmp_path) == []


def test_a_dependency_that_is_not_locked_is_told_with_the_cure_and_one_of_a_strangers_plugin_is_not(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    installing(dev, monkeypatch, tmp_path / "a", "somebodys 1 requires mcap, which is not installed.\n")
    with pytest.raises(SystemExit, match=r"requires mcap(.|\n)*nox -s lock"):
        installing(dev, monkeypatch, tmp_path / "b", "mosaic-sim 0.1.0 requires mcap, which is not installed.\n")


def test_packages_that_do_not_come_end_it(dev: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dev, "_found_node", lambda: "/usr/bin/node")
    monkeypatch.setattr(dev, "install_packages", lambda node: sys.exit("This failed: npm ci"))
    monkeypatch.setattr(dev, "install_python", lambda: None)
    with pytest.raises(SystemExit, match="npm ci"):
        dev.install()


def test_a_python_without_venv_says_which_package_to_install(dev: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ensurepip", None)
    with pytest.raises(SystemExit, match=r"sudo apt install python3\.\d+-venv"):
        dev._check_python()


def test_an_old_python_is_told_so(dev: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 10, 0))
    with pytest.raises(SystemExit, match=r"Python 3\.11 or newer"):
        dev._check_python()
