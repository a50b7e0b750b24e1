"""The table of pairs: what a run writes, what it leaves alone, and when it fails."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pair_report
import pytest
from pair_report import Pair, PairReport, merged, parsed, read, result_of, write

HERE = Path(__file__).parent
THIS = "tests/stacks/test_pair_report.py::test_the_peers_import_nothing_of_ours"
OTHER = "tests/stacks/test_pair_report.py::test_both_spellings_of_a_pair_are_read"


def pair(test: str = THIS, result: str = "works", what: str = "data") -> Pair:
    return Pair("our robot", "theirs", what, result, test)


def report(test: str = THIS, outcome: str = "passed", when: str = "call", **more: Any) -> Any:
    is_failed, is_skipped = outcome == "failed", outcome == "skipped"
    properties = [("pair", "our robot | theirs | data")]
    return SimpleNamespace(
        nodeid=test, when=when, failed=is_failed, skipped=is_skipped, user_properties=properties, **more
    )


def test_the_peers_import_nothing_of_ours() -> None:
    for path in (HERE / "independent").glob("*.*"):
        ours = re.findall(r"^\s*(?:from|import)\b.*mosaic.*$", path.read_text(), re.MULTILINE | re.IGNORECASE)
        assert ours == [], path


def test_both_spellings_of_a_pair_are_read() -> None:
    assert parsed("our robot | theirs | data: all", "works", THIS) == pair(what="data: all")
    assert parsed("our robot ↔ theirs: data", "works", THIS) == pair()
    with pytest.raises(ValueError, match="is not"):
        parsed("nonsense", "works", THIS)


@pytest.mark.parametrize(
    ("seen", "result"),
    [
        (report(), "works"),
        (report(outcome="failed"), "fails"),
        (report(outcome="failed", when="teardown"), "fails"),
        (report(when="setup"), ""),
        (report(outcome="skipped"), ""),
        (report(outcome="skipped", wasxfail="reason: no such codec"), "does not work: no such codec"),
    ],
)
def test_the_result_is_what_the_test_saw(seen: Any, result: str) -> None:
    assert result_of(seen) == result


def test_rows_stay_whose_tests_were_left_out_and_go_with_their_tests() -> None:
    before = [pair(), pair(OTHER, what="video"), pair("tests/stacks/test_pair_report.py::test_gone")]
    assert merged(before, {THIS: [pair(result="fails")]}) == [pair(result="fails"), pair(OTHER, what="video")]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """`run(seen, updates=…, is_ci=…)` → whether the run failed, and the rows afterwards; the table has one row."""
    monkeypatch.setattr(pair_report.subprocess, "run", lambda *_, **__: None)
    monkeypatch.setattr(pair_report, "stacks", dict)
    path = tmp_path / "pairs.json"

    def once(seen: Any, *, updates: bool, is_ci: bool) -> tuple[bool, list[Pair]]:
        write(path, [pair()], {"aiortc": "0.1"})
        plugin = PairReport(path, updates=updates, is_ci=is_ci)
        plugin.pytest_runtest_logreport(seen)
        session = SimpleNamespace(exitstatus=0, config=SimpleNamespace())
        plugin.pytest_sessionfinish(session)  # type: ignore[arg-type]
        assert bool(plugin.stale) == bool(session.exitstatus)
        return bool(session.exitstatus), read(path)

    return once


def test_a_whole_run_writes_and_one_in_ci_fails_instead(run: Any) -> None:
    changed = report(outcome="failed")
    assert run(changed, updates=True, is_ci=False) == (False, [pair(result="fails")])
    assert run(changed, updates=True, is_ci=True) == (True, [pair()])
    assert run(report(), updates=True, is_ci=True) == (False, [pair()]), "other versions are no difference"


def test_a_part_of_a_run_neither_writes_nor_compares(run: Any) -> None:
    assert run(report(outcome="failed"), updates=False, is_ci=True) == (False, [pair()])
