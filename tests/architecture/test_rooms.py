"""The rooms inside the layers: imports among them go one way, no file is in a circle, and none is crowded.

An import counts also where only the type checker reads it: whoever wants to understand a file has to follow it.
"""

from __future__ import annotations

import ast
import os
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).parents[2]
MOST_FILES = 20

CORE_ROOMS = {
    "machines": [
        "timing",
        "laboratory",
        "diagnosis",
        "control",
        "delivery",
        "commands",
        "requests",
        "congestion",
        "media",
        "peers",
        "signaling",
        "lan",
    ],
    "runtime": [
        "timing",
        "threads",
        "observation",
        "widgets",
        "configuration",
        "transport",
        "commands",
        "delivery",
        "media",
        "signaling",
        "lan",
        "handlers",
        "control",
        "peers",
        "reload",
    ],
    "adapters": ["machine", "signaling", "lan", "aiortc_private", "video", "sound", "peers", "diagnosis"],
    "operator": ["signaling", "lan", "delivery", "stores", "control", "peers"],
    "cli": ["terminal", "configuration", "plugin", "robot", "operator", "diagnosis"],
}
"""Lowest first: a room may import those before it. Files beside the rooms may import all of them, and no room them."""
SERVER_ROOMS = ["security", "entrance", "storage", "switchboard", "sockets", "rest", "web"]
"""The same for ``mosaic_server``: what lies beside these rooms (settings, services) may stand between any two."""
DASHBOARD_ROOMS = {
    "protocol": [],
    "client": [
        "words",
        "described",
        "timing",
        "platform",
        "resume",
        "control",
        "signaling",
        "delivery",
        "diagnosis",
        "stores",
        "requests",
        "peers",
        "bindings",
    ],
    "robot": ["signaling", "control", "media", "connectors", "sensors", "peers"],
    "react": [],
    "widgets": [
        "theme",
        "schema",
        "form",
        "clouds",
        "paint",
        "stores",
        "registry",
        "delivery",
        "frame",
        "pictures",
        "gamepad",
        "control",
        "page",
    ],
    "app": [
        "shell",
        "session",
        "connection",
        "describe",
        "grants",
        "journal",
        "check",
        "share",
        "robots",
        "plugins",
        "robot",
    ],
}
"""The same for the packages below ``dashboard/packages``. A folder named like a component (``DrivePad``) is a widget:
it stands above these rooms, and may borrow from another widget, in no circle."""

Graph = Mapping[str, set[str]]


def python_files() -> dict[str, Path]:
    """Every module of the product by its dotted name."""
    packages = [ROOT / "mosaic_core", *sorted(ROOT.glob("plugins/*/mosaic_*")), *sorted(ROOT.glob("bench/*_bench"))]
    found = {}
    for package in packages:
        for path in sorted(package.rglob("*.py")):
            found[".".join(path.relative_to(package.parent).with_suffix("").parts)] = path
    return found


def python_graph(files: Mapping[str, Path]) -> dict[str, set[str]]:
    graph: dict[str, set[str]] = {name: set() for name in files}
    for name, path in files.items():
        for node in ast.walk(ast.parse(path.read_text())):
            graph[name] |= {one for one in _imported(node, files) if one != name}
    return graph


def _imported(node: ast.AST, files: Mapping[str, Path]) -> Iterator[str]:
    """The files that an import statement loads; a package is its ``__init__``."""
    if isinstance(node, ast.Import):
        names = [(alias.name,) for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
        names = [(f"{node.module}.{alias.name}", node.module) for alias in node.names]
    else:
        return
    for choices in names:
        spellings = (f"{name}{ending}" for name in choices for ending in ("", ".__init__"))
        yield from [one for one in spellings if one in files][:1]


def typescript_graph() -> dict[str, set[str]]:
    """Every source file of the dashboard by its path below ``dashboard/packages``, without the tests beside them."""
    packages = ROOT / "dashboard" / "packages"
    files = {
        path.relative_to(packages).as_posix(): path
        for path in sorted(packages.glob("*/src/**/*.ts*"))
        if path.suffix in (".ts", ".tsx") and ".test." not in path.name
    }
    imported = re.compile(r"(?:from|import)\s*\(?\s*'(\.[^']+)'")
    graph = {}
    for name, path in files.items():
        folder = PurePosixPath(name).parent
        targets = (os.path.normpath(folder / found) for found in imported.findall(path.read_text()))
        graph[name] = {one for target in targets for one in _spellings(target) if one in files}
    return graph


def _spellings(target: str) -> tuple[str, ...]:
    return target, f"{target}.ts", f"{target}.tsx", f"{target}/index.ts"


def circle_in(graph: Graph) -> list[str]:
    """One circle of imports; empty if there is none."""
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        return list(error.args[1])
    return []


def misdirected(graph: Graph, prefix: tuple[str, ...], separator: str, rooms: list[str]) -> list[str]:
    """Imports below ``prefix`` that point from a room to a later one, or to a file beside the rooms."""
    rank = {room: place for place, room in enumerate(rooms)}
    found = []
    for name, targets in graph.items():
        own = _room(name, prefix, separator)
        for target in targets if own in rank else ():
            other = _room(target, prefix, separator)
            if other is not None and other != own and rank.get(other, len(rooms)) > rank[own]:
                found.append(f"{name} imports {target}")
    return found


def among_rooms(graph: Graph, prefix: tuple[str, ...], separator: str) -> dict[str, set[str]]:
    """Which rooms below ``prefix`` import which others."""
    found: dict[str, set[str]] = defaultdict(set)
    for name, targets in graph.items():
        own = _room(name, prefix, separator)
        if own is not None:
            others = {_room(target, prefix, separator) for target in targets}
            found[own] |= {room for room in others if room not in (None, own)}
    return found


def _room(name: str, prefix: tuple[str, ...], separator: str) -> str | None:
    """The room of a file, ``""`` for one beside the rooms, ``None`` for one of another layer."""
    parts = tuple(name.split(separator))
    if parts[: len(prefix)] != prefix:
        return None
    rest = parts[len(prefix) :]
    return rest[0] if len(rest) > 1 else ""


@pytest.fixture(scope="module")
def core() -> dict[str, set[str]]:
    return python_graph(python_files())


@pytest.fixture(scope="module")
def dashboard() -> dict[str, set[str]]:
    return typescript_graph()


def test_no_python_file_is_in_a_circle_of_imports(core: Graph) -> None:
    assert circle_in(core) == []


def test_no_typescript_file_is_in_a_circle_of_imports(dashboard: Graph) -> None:
    assert circle_in(dashboard) == []


@pytest.mark.parametrize("layer", CORE_ROOMS)
def test_every_room_of_a_layer_has_its_place(layer: str) -> None:
    folder = ROOT / "mosaic_core" / layer
    assert {path.parent.name for path in folder.glob("*/*.py")} == set(CORE_ROOMS[layer])


@pytest.mark.parametrize("layer", CORE_ROOMS)
def test_the_rooms_of_a_layer_import_one_way(layer: str, core: Graph) -> None:
    assert misdirected(core, ("mosaic_core", layer), ".", CORE_ROOMS[layer]) == []


def test_the_rooms_of_the_server_import_one_way(core: Graph) -> None:
    among_rooms = {name: {one for one in targets if one.count(".") > 1} for name, targets in core.items()}
    assert misdirected(among_rooms, ("mosaic_server",), ".", SERVER_ROOMS) == []


@pytest.mark.parametrize("package", DASHBOARD_ROOMS)
def test_the_rooms_of_a_dashboard_package_import_one_way(package: str, dashboard: Graph) -> None:
    rooms = DASHBOARD_ROOMS[package]
    folders = {path.name for path in (ROOT / "dashboard/packages" / package / "src").iterdir() if path.is_dir()}
    widgets = {name for name in folders if name[0].isupper()}
    assert folders - widgets == set(rooms)
    assert misdirected(dashboard, (package, "src"), "/", rooms) == []
    assert circle_in(among_rooms(dashboard, (package, "src"), "/")) == []


def test_no_folder_is_crowded() -> None:
    patterns = (
        "mosaic_core/**/*.py",
        "plugins/**/*.py",
        "tests/**/*.py",
        "bench/**/*.py",
        "dashboard/packages/**/*.ts*",
    )
    counts: Counter[Path] = Counter()
    for path in (path for pattern in patterns for path in ROOT.glob(pattern)):
        if "node_modules" not in path.parts and path.name != "__init__.py":
            counts[path.parent.relative_to(ROOT)] += 1
    assert {str(folder): number for folder, number in counts.items() if number > MOST_FILES} == {}


CIRCLES = [
    ({"a": {"b"}, "b": {"a"}}, True),
    ({"a": {"b"}, "b": {"c"}, "c": set()}, False),
    ({"a": {"b", "c"}, "b": {"c"}, "c": {"a"}}, True),
]


@pytest.mark.parametrize(("graph", "is_circle"), CIRCLES)
def test_a_circle_is_found(graph: Graph, is_circle: bool) -> None:
    assert bool(circle_in(graph)) is is_circle


def test_an_import_against_the_order_is_found() -> None:
    graph = defaultdict(
        set, {"top.layer.low.a": {"top.layer.high.b", "top.other.c"}, "top.layer.high.b": {"top.layer.x"}}
    )
    wrong = misdirected(graph, ("top", "layer"), ".", ["low", "high"])
    assert wrong == ["top.layer.low.a imports top.layer.high.b", "top.layer.high.b imports top.layer.x"]
