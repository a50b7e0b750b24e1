"""What `mutants.toml` and `equivalent.toml` name is there, so that a moved file is moved there too; and what
`results.toml` tells is true of the modules as they are."""

from __future__ import annotations

import tomllib
from pathlib import Path

import mutant_results
import pytest
from mutant_results import SAMPLE, digest, note, results

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((Path(__file__).parent / "mutants.toml").read_text())
EQUIVALENTS = tomllib.loads((Path(__file__).parent / "equivalent.toml").read_text()).get("equivalent", [])
PARTS = SETTINGS["parts"] | {"elsewhere": SETTINGS["elsewhere"]}
GUARDED = [module for part in SETTINGS["parts"].values() for module in part]
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


@pytest.mark.parametrize("module", GUARDED)
def test_the_mutants_of_a_guarded_module_were_tried_since_it_changed_and_none_lives(module: str) -> None:
    found, again = results().get(module), f".venv/bin/nox -s mutants -- --module {module}"
    assert found is not None, f"nobody tried the mutants of {module}: {again}"
    assert found["digest"] == digest((ROOT / module).read_text()), f"{module} is another since {found['on']}: {again}"
    assert found["alive"] == 0, f"{found['alive']} mutants of {module} live: {again}"


def test_a_result_is_of_a_guarded_module_or_of_the_sample() -> None:
    assert set(results()) == {*GUARDED, SAMPLE}


@pytest.mark.parametrize(
    ("changed", "is_same"),
    [
        ("def f(a):\n    return a < 1\n", True),
        ('"""It counts."""\ndef f(a):\n    """Why."""\n    return (\n        a < 1  # or so\n    )\n', True),
        ("def f(a):\n    return a <= 1\n", False),
        ("def f(a):\n    return a < 1.0\n", False),
        ("def f(b):\n    return b < 1\n", False),
        ("def f(a):\n    return a < 1\nf(0)\n", False),
    ],
)
def test_a_module_is_another_when_its_program_is(changed: str, is_same: bool) -> None:
    assert (digest(changed) == digest("def f(a):\n    return a < 1\n")) is is_same


def test_a_result_takes_the_place_of_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutant_results, "RESULTS", tmp_path / "results.toml")
    note(SAMPLE, mutants=60)
    note("m.py", alive=1, digest="abc")
    note("m.py", alive=0, digest="def")
    found = {name: {key: its[key] for key in its if key != "on"} for name, its in results().items()}
    assert list(found.items()) == [("m.py", {"alive": 0, "digest": "def"}), (SAMPLE, {"mutants": 60})]
