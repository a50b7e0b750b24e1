"""The layers of the tree: an import may only point to a lower one."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = ROOT / "mosaic_core"

LAYERS = ["words", "machines", "contract", "messages", "runtime", "adapters"]
TOP = {
    "operator": 6,
    "laboratory": 7,
    "harness": 7,
    "drill": 8,
    "doctor": 8,
    "bench": 8,
    "ladder": 9,
    "testing": 10,
    "cli": 10,
}
RANK = {**{name: rank for rank, name in enumerate(LAYERS)}, **TOP}
"""A new folder must be given its place here. What stands above `adapters` composes what lies below: the operator, the
laboratory (whole robots on networks that can be made bad), the harness (one handler alone), and the three that
experiment with them: the drill, the doctor and the bench. The ladder judges plugins with all of them; the kit for
plugin authors offers them."""

HEAVY = ("aiortc", "aioice", "av", "cv2")
ONLY_IN_ADAPTERS = {*HEAVY, "websockets"}


A_MODULE = re.compile(rf"(?:mosaic_core\.)?(?:{'|'.join(RANK)})(?:\.\w+)+")


def arrows_of(path: Path) -> set[str]:
    """Every module of the core that a reader of `path` is led to: imported, also by the type checker alone, or named in
    a string, by which it is imported later.
    """
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found.add(node.module)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and A_MODULE.fullmatch(node.value):
            found |= _modules_named(node.value.removeprefix("mosaic_core."))
    return {name for name in found if name.startswith("mosaic_core.")}


def _modules_named(word: str) -> set[str]:
    place = CORE / word.replace(".", "/")
    return {f"mosaic_core.{word}"} if place.is_dir() or place.with_suffix(".py").is_file() else set()


@cache
def imports_of(path: Path) -> set[str]:
    """Every module that `path` imports, without those that only the type checker reads."""
    found, unread = set(), [ast.parse(path.read_text())]
    while unread:
        node: ast.AST = unread.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found.add(node.module)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            unread.extend(node.orelse)
        elif not isinstance(node, ast.expr):
            unread.extend(ast.iter_child_nodes(node))
    return found


def imports_below(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*.py")):
        yield from ((path, name) for name in sorted(imports_of(path)))


def layer_of(path: Path) -> str:
    return path.relative_to(CORE).parts[0]


def test_every_folder_has_its_place() -> None:
    folders = {path.name for path in CORE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    assert folders == set(RANK)


def upward_in(path: Path, own: str) -> list[str]:
    """The modules of the core in layers not below `own` to which `path` leads."""
    layers = {name: name.split(".")[1] for name in arrows_of(path)}
    return sorted(name for name, layer in layers.items() if layer != own and RANK.get(layer, 0) >= RANK[own])


def test_an_import_points_to_a_lower_layer_only() -> None:
    inside = [path for path in sorted(CORE.rglob("*.py")) if path.parent != CORE]
    assert [f"{path.relative_to(ROOT)}: {name}" for path in inside for name in upward_in(path, layer_of(path))] == []


def test_an_upward_arrow_is_found_in_an_import_of_the_type_checker_and_in_a_string(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        "if TYPE_CHECKING:\n    from mosaic_core.ladder.missing import missing_to_gold\n"
        "_NAMES_IN = {'cli.main': 'main', 'words.codes': 'REASONS', 'cli.nowhere': ''}\n"
    )
    assert upward_in(module, "harness") == ["mosaic_core.cli.main", "mosaic_core.ladder.missing"]


def test_only_adapters_touch_the_network_and_codec_libraries() -> None:
    found = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path, name in imports_below(CORE)
        if path.parent != CORE and layer_of(path) != "adapters" and name.split(".")[0] in ONLY_IN_ADAPTERS
    ]
    assert found == []


def test_machines_know_no_clock_socket_loop_or_file() -> None:
    forbidden = {"asyncio", "time", "socket", "threading", "random", "datetime", "pathlib", "os"}
    found = [(path.name, name) for path, name in imports_below(CORE / "machines") if name.split(".")[0] in forbidden]
    assert found == []


def test_imports_are_found_wherever_they_stand_but_for_the_type_checkers(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        "import a.b\nif TYPE_CHECKING:\n    import c\nelse:\n    import d\n"
        "def work():\n    try:\n        from e.f import g\n    except ImportError:\n        import h\n"
        "match x:\n    case 1:\n        import i\nasync def other():\n    async with y:\n        import j\n"
    )
    assert imports_of(module) == {"a.b", "d", "e.f", "h", "i", "j"}


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


def test_the_server_uses_words_and_machines_and_the_search_for_widgets_only() -> None:
    ours = [
        (path.name, name)
        for path, name in imports_below(ROOT / "plugins/mosaic-server/mosaic_server")
        if name.startswith("mosaic_core.")
    ]
    assert ours
    upward = [(path, name) for path, name in ours if name.split(".")[1] not in {"words", "machines"}]
    # Which bytes a module has is said by robots and served by servers: read by the same lines.
    assert upward == [("widget_shelf.py", "mosaic_core.runtime.widgets.widget_modules")]
