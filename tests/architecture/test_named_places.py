"""A file or module that a docstring or a comment names in backticks exists."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE = ROOT / "mosaic_core"
PYTHON_FILES = [path for top in (CORE, *ROOT.glob("plugins/*/mosaic_*")) for path in sorted(top.rglob("*.py"))]
PAGE_FILES = sorted(ROOT.glob("dashboard/packages/*/src/**/*.ts*"))

LAYERS = "|".join(sorted(path.name for path in CORE.iterdir() if path.is_dir()))
A_FILE = re.compile(r"`((?:[\w.-]+/)+[\w-]+\.(?:py|tsx?|json|md))`")
A_MODULE = re.compile(rf"`((?:{LAYERS})(?:\.[a-z]\w*)+)`")


@cache
def _text(path: Path) -> str:
    return path.read_text()


def is_file(named: str) -> bool:
    return (ROOT / named).is_file() or (CORE / named).is_file()


def is_module(named: str) -> bool:
    """A module or package of the core, or a name that such a module has."""
    inside, _, name = named.rpartition(".")
    whole, outer = CORE / named.replace(".", "/"), (CORE / inside.replace(".", "/")).with_suffix(".py")
    return (
        whole.is_dir()
        or whole.with_suffix(".py").is_file()
        or (outer.is_file() and re.search(rf"\b{name}\b", _text(outer)) is not None)
    )


def missing(path: Path) -> list[str]:
    files = [named for named in A_FILE.findall(_text(path)) if not is_file(named)]
    return files + [named for named in A_MODULE.findall(_text(path)) if not is_module(named)]


def test_every_place_that_is_named_exists() -> None:
    found = {path.relative_to(ROOT).as_posix(): missing(path) for path in (*PYTHON_FILES, *PAGE_FILES)}
    assert {path: places for path, places in found.items() if places} == {}


def test_a_place_that_is_gone_is_found(tmp_path: Path) -> None:
    told = tmp_path / "told.py"
    told.write_text(
        '"""The twin of `machines/resume.py`, see ``machines.resume`` and ``machines.delivery.resume``."""\n'
    )
    assert missing(told) == ["machines/resume.py", "machines.resume"]
