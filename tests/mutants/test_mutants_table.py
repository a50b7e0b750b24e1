"""What `mutants.toml` and `equivalent.toml` name is there, so that a moved file is moved there too."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((Path(__file__).parent / "mutants.toml").read_text())
EQUIVALENTS = tomllib.loads((Path(__file__).parent / "equivalent.toml").read_text()).get("equivalent", [])
PARTS = SETTINGS["parts"] | {"elsewhere": SETTINGS["elsewhere"]}
MODULES = {module: tests for part in PARTS.values() for module, tests in part.items()}


@pytest.mark.parametrize("module", MODULES)
def test_a_module_of_the_table_and_its_tests_are_there(module: str) -> None:
    for path in (module, *MODULES[module]):
        assert (ROOT / path.partition("::")[0]).is_file(), f"mutants.toml names {path}, which is not there"


def test_a_module_belongs_to_one_part() -> None:
    named = [module for part in PARTS.values() for module in part]
    assert sorted(named) == sorted(set(named))


def test_an_excuse_has_a_module_of_the_table_its_text_and_a_reason() -> None:
    for entry in EQUIVALENTS:
        assert entry["module"] in MODULES, entry
        source = " ".join((ROOT / entry["module"]).read_text().split())
        assert " ".join(entry["original"].split()) in source, f"{entry['original']!r} is not in {entry['module']}"
        assert entry["reason"].strip(), entry
