"""One list of Pythons is locked, declared, and run by the workflow; and nothing is used that leaves in one of them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from release.requirements import PROJECTS, ROOT, read
from release.wheels import PYTHONS

VERSIONS = [f"{major}.{minor}" for major, minor in PYTHONS]
LEAVING = {
    "asyncio.get_event_loop": "raises without a loop from 3.14 on",
    "asyncio.set_event_loop": "is for policies, which go in 3.16",
    "asyncio.get_event_loop_policy": "goes in 3.16",
    "asyncio.set_event_loop_policy": "goes in 3.16",
    "asyncio.iscoroutinefunction": "goes in 3.16: inspect has it",
    "asyncio.get_child_watcher": "went in 3.14",
    "uvloop.install": "sets a policy: uvloop.new_event_loop as loop_factory",
    "datetime.datetime.utcnow": "is deprecated since 3.12",
    "datetime.utcnow": "is deprecated since 3.12",
    "ast.Num": "went in 3.14",
    "ast.Str": "went in 3.14",
    "pkgutil.find_loader": "went in 3.14",
    "pkgutil.get_loader": "went in 3.14",
    "codecs.open": "is deprecated since 3.14",
    "locale.getdefaultlocale": "is deprecated since 3.11",
    "os.popen": "is softly deprecated since 3.14",
}
GONE = {"aifc", "asyncore", "asynchat", "audioop", "cgi", "crypt", "distutils", "imghdr", "imp", "nntplib", "pipes",
        "pkg_resources", "smtpd", "sndhdr", "telnetlib", "uu", "xdrlib"}  # fmt: skip
"""Modules of 3.11 that 3.12 or 3.13 no longer has."""
FILES = sorted(path for place in ("mosaic_core", "plugins", "examples", "release", "tests", "bench", "docs")
               for path in (ROOT / place).rglob("*.py"))  # fmt: skip


def uses(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node) in LEAVING:
            yield f"{ast.unparse(node)} {LEAVING[ast.unparse(node)]}"
        elif isinstance(node, ast.Import):
            yield from (f"{alias.name} is gone" for alias in node.names if alias.name.split(".")[0] in GONE)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (f"{name} {LEAVING[name]}" for name in names if name in LEAVING)
            if node.module.split(".")[0] in GONE:
                yield f"{node.module} is gone"
        elif isinstance(node, ast.Try):
            yield from _ways_out(node.finalbody)


def _ways_out(body: list[ast.stmt]) -> Iterator[str]:
    """`return` in a `finally` swallows the exception; 3.14 warns of it."""
    for statement in body:
        if isinstance(statement, ast.Return):
            yield "return in a finally"
        elif not isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            for name in ("body", "orelse", "finalbody"):
                yield from _ways_out(getattr(statement, name, []))


def test_no_file_uses_what_leaves_in_a_supported_python() -> None:
    found = {f"{path.relative_to(ROOT)}: {use}" for path in FILES for use in uses(ast.parse(path.read_text()))}
    assert not found


@pytest.mark.parametrize(
    "source",
    [
        "import asyncio\nasyncio.get_event_loop()",
        "from asyncio import iscoroutinefunction",
        "import telnetlib",
        "from distutils.core import setup",
        "def f():\n try: pass\n finally:\n  if x: return",
    ],
)
def test_what_leaves_is_found(source: str) -> None:
    assert list(uses(ast.parse(source)))


def test_a_function_inside_a_finally_may_return() -> None:
    assert not list(uses(ast.parse("try: pass\nfinally:\n def f():\n  return 1")))


@pytest.mark.parametrize("project", PROJECTS, ids=lambda project: project.name if project != ROOT else "mosaic-core")
def test_a_distribution_declares_no_other_pythons_than_those_that_are_locked(project: Path) -> None:
    table = read(project)["project"]
    declared = [line.rpartition(" ")[2] for line in table.get("classifiers", []) if re.search(r":: 3\.\d+$", line)]
    assert declared in ([], VERSIONS)
    assert table["requires-python"] == f">={VERSIONS[0]}"


def test_the_workflow_runs_every_python_that_is_declared() -> None:
    jobs = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text())["jobs"]
    matrix = jobs["versions"]["strategy"]["matrix"]
    whole = [
        step["with"]["python-version"] for step in jobs["whole"]["steps"] if "python-version" in step.get("with", {})
    ]
    assert sorted({*matrix["python"], *whole}) == VERSIONS
