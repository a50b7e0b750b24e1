"""Each connector type has tests for a device that vanishes, a flood and garbage, or a reason why it has none."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("endurance.toml")
ROWS: list[dict[str, Any]] = tomllib.loads(TABLE.read_text())["connectors"]
TRIALS = ("vanish", "flood", "garbage")
AWAY = re.compile(r"_for_(thirty_seconds|30_s)_")
"""How a test says in its name that the device is away so long, on a fake clock mostly."""


def types_of_ours() -> set[str]:
    projects = [ROOT / "pyproject.toml", *ROOT.glob("plugins/*/pyproject.toml")]
    points = [tomllib.loads(one.read_text())["project"].get("entry-points", {}) for one in projects]
    return {name for groups in points for name in groups.get("mosaic.connectors", {})}


@cache
def names_of_tests(file: str) -> frozenset[str]:
    tree = ast.parse((ROOT / file).read_text())
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    return frozenset(node.name for node in functions if node.name.startswith("test_"))


def answers() -> Iterator[Any]:
    for row in ROWS:
        for trial in TRIALS:
            found = row[trial]
            for answer in found if isinstance(found, list) else [found]:
                yield pytest.param(answer, id=f"{row['types'][0]}-{trial}-{answer.rpartition('::')[2][:40]}")


def test_every_connector_type_is_in_the_table_once_and_no_other() -> None:
    rows = Counter(name for row in ROWS for name in row["types"])
    assert set(rows) == types_of_ours(), f"add what is missing to {TABLE.relative_to(ROOT)}"
    assert max(rows.values()) == 1


def test_a_row_has_the_three_trials_and_nothing_else() -> None:
    assert {frozenset(row) for row in ROWS} == {frozenset({"types", *TRIALS})}


@pytest.mark.parametrize("answer", list(answers()))
def test_what_the_table_names_is_a_test_or_a_reason(answer: str) -> None:
    file, found, name = answer.partition("::")
    if answer.startswith("none: "):
        assert len(answer) > 20
    else:
        assert found
        assert name in names_of_tests(file), f"{file} has no {name}"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["types"][0])
def test_what_vanishes_is_away_for_thirty_seconds_or_there_is_a_reason(row: dict[str, Any]) -> None:
    answers = row["vanish"] if isinstance(row["vanish"], list) else [row["vanish"]]
    assert any(one.startswith("none: ") or AWAY.search(one.partition("::")[2]) for one in answers)
