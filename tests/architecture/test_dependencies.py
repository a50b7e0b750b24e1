"""What a distribution imports it declares: nothing is there only because something else happens to need it."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DISTRIBUTIONS = [ROOT, *sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))]
CONTRACT = {"pydantic"}
"""Params and messages are its models: it is part of what `mosaic_core` offers to plugins."""
COMES_WITH = {"pydantic_core": "pydantic"}
"""A version of pydantic and its core belong to each other."""
BY_INVITATION = {"mosaic_core/testing/pytest_plugin.py": "pytest"}
"""Loaded by pytest itself."""


INSTALLED = packages_distributions()


def distributions_of(package: str) -> set[str]:
    """Those that contain it; our own are named like their package."""
    package = COMES_WITH.get(package, package)
    return {normal(name) for name in (package, *INSTALLED.get(package, ()))}


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def declared_by(folder: Path) -> set[str]:
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    extras = [line for lines in project.get("optional-dependencies", {}).values() for line in lines]
    lines = [project["name"], *project.get("dependencies", []), *extras]
    return {normal(re.split(r"[^\w.-]", line, maxsplit=1)[0]) for line in lines}


def imported_packages(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("folder", DISTRIBUTIONS, ids=lambda folder: folder.name if folder != ROOT else "mosaic-core")
def test_what_is_imported_is_declared(folder: Path) -> None:
    declared, undeclared = declared_by(folder) | CONTRACT, set()
    for path in sorted(folder.glob("mosaic_*/**/*.py")):
        name = str(path.relative_to(ROOT))
        for package in set(imported_packages(path)) - sys.stdlib_module_names - {BY_INVITATION.get(name)}:
            if not distributions_of(package) & declared:
                undeclared.add(f"{name} imports {package}")
    assert not undeclared
