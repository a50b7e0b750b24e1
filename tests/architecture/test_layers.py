"""The layers of the tree: an import may only point to a lower one."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = ROOT / "mosaic_core"

LAYERS = ["words", "machines", "contract", "runtime", "adapters"]
TOP = {"operator": 5, "laboratory": 6, "testing": 7, "drill": 7, "doctor": 7, "bench": 7, "cli": 8}
RANK = {**{name: rank for rank, name in enumerate(LAYERS)}, **TOP}
"""A new folder must be given its place here. What stands above `adapters` composes what lies below: the operator, the
laboratory (whole robots on networks that can be made bad), and the four that experiment in it: the kit for plugin
authors, the drill, the doctor and the bench."""

HEAVY = ("aiortc", "aioice", "av", "cv2")
ONLY_IN_ADAPTERS = {*HEAVY, "websockets"}


def modules() -> Iterator[Path]:
    yield from sorted(path for path in CORE.rglob("*.py") if path.parent != CORE)


def imports_of(path: Path, *, at_runtime: bool = False) -> Iterator[str]:
    """Every module that `path` imports; with `at_runtime` without those under `if TYPE_CHECKING`."""
    tree = ast.parse(path.read_text())
    skipped: set[ast.AST] = set()
    if at_runtime:
        for node in ast.walk(tree):
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
                skipped |= {inner for part in node.body for inner in ast.walk(part)}
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module


def layer_of(path: Path) -> str:
    return path.relative_to(CORE).parts[0]


def test_every_folder_has_its_place() -> None:
    folders = {path.name for path in CORE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    assert folders == set(RANK)


@pytest.mark.parametrize("path", list(modules()), ids=lambda path: str(path.relative_to(CORE)))
def test_an_import_points_to_a_lower_layer_only(path: Path) -> None:
    own = layer_of(path)
    for name in imports_of(path, at_runtime=True):
        parts = name.split(".")
        if parts[0] != "mosaic_core" or len(parts) == 1:
            continue
        other = parts[1]
        assert other == own or RANK[other] < RANK[own], f"{path.relative_to(ROOT)} imports {name}"


@pytest.mark.parametrize("path", list(modules()), ids=lambda path: str(path.relative_to(CORE)))
def test_only_adapters_touch_the_network_and_codec_libraries(path: Path) -> None:
    if layer_of(path) == "adapters":
        return
    for name in imports_of(path, at_runtime=True):
        assert name.split(".")[0] not in ONLY_IN_ADAPTERS, f"{path.relative_to(ROOT)} imports {name}"


def test_machines_know_no_clock_socket_loop_or_file() -> None:
    forbidden = {"asyncio", "time", "socket", "threading", "random", "datetime", "pathlib", "os"}
    for path in sorted((CORE / "machines").rglob("*.py")):
        used = {name.split(".")[0] for name in imports_of(path, at_runtime=True)} & forbidden
        assert not used, f"{path.name} imports {used}"


def loaded_by(code: str) -> set[str]:
    """The top-level modules in a fresh interpreter after running `code`."""
    script = f"{code}\nimport sys; print(' '.join(sorted({{name.split('.')[0] for name in sys.modules}})))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_core_loads_no_webrtc_and_no_video() -> None:
    assert not loaded_by("import mosaic_core") & {*HEAVY, "numpy", "websockets", "httpx"}


def test_the_lazy_names_are_not_loaded_with_the_core_and_load_no_webrtc_themselves() -> None:
    assert "ruamel" not in loaded_by("import mosaic_core")
    assert not loaded_by("from mosaic_core import AutoConfigurer, ConnectorResolver") & {*HEAVY, "numpy", "httpx"}


@pytest.mark.parametrize("words", [["--help"], ["connectors", "list"], ["validate", "--help"]])
def test_the_command_line_loads_no_webrtc_and_no_video(words: list[str]) -> None:
    code = (
        "import sys, contextlib, io\n"
        f"sys.argv = ['mosaic', *{words!r}]\n"
        "from mosaic_core.cli.main import main\n"
        "with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()): main()"
    )
    assert not loaded_by(code) & set(HEAVY)


def test_the_server_loads_no_webrtc_and_no_video() -> None:
    assert not loaded_by("import mosaic_server.app") & {*HEAVY, "numpy"}


def test_the_server_uses_words_and_machines_only() -> None:
    for path in sorted((ROOT / "plugins/mosaic-server/mosaic_server").rglob("*.py")):
        for name in imports_of(path, at_runtime=True):
            if name.startswith("mosaic_core."):
                assert name.split(".")[1] in {"words", "machines"}, f"{path.name} imports {name}"
