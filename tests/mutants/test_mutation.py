"""The runner changes what it says, names it so that lines may move, and notices an excuse that excuses nothing."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("cosmic_ray", reason="pip install --group mutants")

from collected import tried
from cosmic_ray.mutating import mutate_code
from equivalents import Equivalents
from mutation import mutants_of
from operators import OWN
from trial import Limits, module_name

if TYPE_CHECKING:
    from mutation import Mutant

OPERATORS = tomllib.loads((Path(__file__).parent / "mutants.toml").read_text())["operators"]
SOURCE = '''\
"""A toy."""

LIMIT = 3


def limited(value: int | None) -> int:
    if value is None:
        return 0
    return min(value, LIMIT)
'''


def mutants(tmp_path: Path, source: str = SOURCE) -> list[Mutant]:
    (tmp_path / "toy.py").write_text(source)
    return mutants_of("toy.py", OPERATORS, tmp_path)


@pytest.mark.parametrize("name", OWN)
def test_an_operator_of_ours_does_what_its_examples_say(name: str) -> None:
    for example in OWN[name].examples():
        assert mutate_code(example.pre_mutation_code, OWN[name](), example.occurrence) == example.post_mutation_code


def test_what_decides_is_changed_and_what_only_the_type_checker_reads_is_not(tmp_path: Path) -> None:
    found = {(one.function, one.original, one.mutated) for one in mutants(tmp_path)}
    assert ("limited", "if value is None:", "if value is not None:") in found
    assert ("limited", "return min(value, LIMIT)", "return max(value, LIMIT)") in found
    assert ("limited", "return 0", "return 1") in found
    assert not [one for one in found if one[1].startswith(("def", "LIMIT"))]


def test_every_mutant_is_another_program(tmp_path: Path) -> None:
    sources = [one.source for one in mutants(tmp_path)]
    assert len({SOURCE, *sources}) == 1 + len(sources)


def test_a_mutant_keeps_its_name_when_lines_move(tmp_path: Path) -> None:
    before = [one.name for one in mutants(tmp_path)]
    assert [one.name for one in mutants(tmp_path, SOURCE.replace("LIMIT = 3", "\n# a word\nLIMIT = 3"))] == before


def test_an_excuse_that_excuses_nothing_is_told(tmp_path: Path) -> None:
    one, other, *_ = mutants(tmp_path)
    known = Equivalents({one.name: "because", other.name: "because", ("else.py", "", "a", "b"): "not tried"})
    assert known.excuses(one)
    [line] = known.stale(["toy.py"])
    assert other.mutated in line


@pytest.mark.parametrize(
    ("test", "verdict"),
    [
        ("assert limited(5) == 3", "killed"),
        ("assert limited(3) == 3", "alive"),
        ("while limited(5) == 5:\n        pass", "time-out"),
        ("assert limited.__name__ == 'other'", "killed"),
    ],
)
def test_a_mutant_lives_as_long_as_no_test_fails(tmp_path: Path, test: str, verdict: str) -> None:
    (tmp_path / "toy.py").write_text(SOURCE)
    (tmp_path / "test_toy.py").write_text(f"from toy import limited\n\n\ndef test_it():\n    {test}\n")
    (tmp_path / "conftest.py").write_text(f"import sys\n\nsys.path.insert(0, {str(tmp_path)!r})\n")
    mutant = next(one for one in mutants(tmp_path) if one.mutated == "return max(value, LIMIT)")
    limits = Limits(cpu_s=1 if verdict == "time-out" else 20)
    trial = tried(tmp_path / "toy.py", "toy", mutant.source, [str(tmp_path / "test_toy.py")], limits)
    assert trial.verdict == verdict, trial.output


def test_the_name_of_a_module_is_what_it_is_imported_as() -> None:
    assert module_name("mosaic_core/words/codes.py") == "mosaic_core.words.codes"
    assert module_name("plugins/mosaic-server/mosaic_server/switchboard/__init__.py") == "mosaic_server.switchboard"
