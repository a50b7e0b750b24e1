"""The table of what became of each guarded module's mutants, and of the last sample: ``results.toml``. A digest beside
each result tells whether the module has changed since."""

from __future__ import annotations

import ast
import datetime
import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results.toml"
SAMPLE = "elsewhere"
"""Stands where a module's name stands."""
HEAD = """\
# What became of the mutants of each guarded module, written by `nox -s mutants` when it has tried all of them; in the
# last line, of the last sample of the modules under `elsewhere`. `digest`: of the program that was changed.

"""


def results() -> dict[str, dict[str, Any]]:
    return tomllib.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def note(name: str, **result: object) -> None:
    """Write the result of a module or of the :data:`SAMPLE`, with the day."""
    lines = {**results(), name: {"on": datetime.date.today(), **result}}
    ordered = sorted(lines, key=lambda one: (one == SAMPLE, one))
    RESULTS.write_text(HEAD + "".join(f'"{one}" = {_inline(lines[one])}\n' for one in ordered))


def _inline(result: Mapping[str, object]) -> str:
    words = (f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}" for key, value in result.items())
    return f"{{ {', '.join(words)} }}"


def digest(source: str) -> str:
    """Of what a module does: comments, docstrings and line breaks may change. The same in every Python."""
    return hashlib.sha256(repr(_meaning(ast.parse(source))).encode()).hexdigest()[:16]


def _meaning(node: object) -> object:
    """Fields that are empty are left out, as Pythons differ in which there are."""
    match node:
        case ast.AST():
            fields = [(name, _meaning(value)) for name, value in ast.iter_fields(node)]
            return type(node).__name__, [field for field in fields if field[1] not in (None, [])]
        case list():
            return [_meaning(one) for one in node if not _is_docstring(one)]
        case _:
            return node


def _is_docstring(node: object) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
