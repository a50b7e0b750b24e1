"""Collects which pairs of ours and theirs a test run proved; `--pairs` brings `pairs.json` and its page up to date.

A test says what it proves with `record_property("pair", "ours | theirs | what was done")`. Rows of tests that a run
leaves out stay as they are, so that the sessions of `nox`, each with its share of the tests, make one table. With
`CI=true` nothing is written: a table that says something else fails the run. Versions of the stacks are told in the
table but not compared.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FORM = re.compile(r"(?P<ours>.+?) (?:\||↔) (?P<theirs>.+?)(?: \||:) (?P<what>.+)")
WORKS, FAILS = "works", "fails"


@dataclass(frozen=True, slots=True, order=True)
class Pair:
    """One row: who met whom and did what, how it went, and the test that saw it."""

    ours: str
    theirs: str
    what: str
    result: str
    test: str

    @property
    def is_current(self) -> bool:
        """Its test still exists."""
        path, _, name = self.test.partition("::")
        text = (ROOT / path).read_text() if (ROOT / path).exists() else ""
        return f"def {name.partition('[')[0]}(" in text


class PairReport:
    """The pytest plugin; :attr:`found` has one entry per test that ran and proves pairs."""

    def __init__(self, path: Path = HERE / "pairs.json", *, updates: bool, is_ci: bool) -> None:
        self.path, self.updates, self.is_ci = path, updates, is_ci
        self.found: dict[str, list[Pair]] = {}
        self.stale = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        texts = [str(value) for name, value in report.user_properties if name == "pair"]
        result = result_of(report)
        if texts and result:
            self.found[report.nodeid] = [parsed(text, result, report.nodeid) for text in texts]

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if not self.updates or not self.found or hasattr(session.config, "workerinput"):
            return
        before = read(self.path)
        after = merged(before, self.found)
        if set(after) == set(before):
            return
        if self.is_ci:
            self.stale = difference(before, after)
            session.exitstatus = pytest.ExitCode.TESTS_FAILED
            return
        write(self.path, after, stacks())
        subprocess.run([sys.executable, str(ROOT / "docs" / "generate_reference.py")], check=True)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self.stale:
            terminalreporter.section("the table of pairs is stale: run ./dev test and commit it", red=True)
            terminalreporter.write_line(self.stale)


def result_of(report: pytest.TestReport) -> str:
    """`works`, `fails`, or why it is known not to work; empty for a skip and for a set-up that went well."""
    if report.failed:
        return FAILS
    if report.when != "call":
        return ""
    if report.skipped:
        return f"does not work: {report.wasxfail.removeprefix('reason: ')}" if hasattr(report, "wasxfail") else ""
    return WORKS


def parsed(text: str, result: str, test: str) -> Pair:
    found = FORM.fullmatch(text)
    if found is None:
        raise ValueError(f"{test}: the pair {text!r} is not 'ours | theirs | what was done'")
    return Pair(found["ours"].strip(), found["theirs"].strip(), found["what"].strip(), result, test)


def merged(before: list[Pair], found: dict[str, list[Pair]]) -> list[Pair]:
    """What this run found, and the rows of tests that it left out and that still exist."""
    kept = [pair for pair in before if pair.test not in found and pair.is_current]
    return sorted([*kept, *(pair for pairs in found.values() for pair in pairs)])


def difference(before: list[Pair], after: list[Pair]) -> str:
    gone = [f"- {pair}" for pair in before if pair not in after]
    return "\n".join([*gone, *(f"+ {pair}" for pair in after if pair not in before)])


def read(path: Path) -> list[Pair]:
    return [Pair(**row) for row in json.loads(path.read_text())["pairs"]] if path.exists() else []


def write(path: Path, pairs: list[Pair], versions: dict[str, str]) -> None:
    """One row per line, so that two branches seldom meet in one."""
    rows = ",\n".join(f"  {json.dumps(asdict(pair), ensure_ascii=False)}" for pair in pairs)
    path.write_text(f'{{"stacks": {json.dumps(versions)},\n "pairs": [\n{rows}\n]}}\n')


def stacks() -> dict[str, str]:
    """Name and version of each WebRTC stack that is installed here."""
    found: dict[str, str] = {}
    for name in ("aiortc", "aioice"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    package = ROOT / "dashboard" / "node_modules" / "node-datachannel" / "package.json"
    if package.exists():
        found["libdatachannel (node-datachannel)"] = json.loads(package.read_text())["version"]
    for name, words in (("Chromium", ["chromium", "--version"]), ("GStreamer", ["gst-inspect-1.0", "--version"])):
        if shutil.which(words[0]):
            said = subprocess.run(words, capture_output=True, text=True, timeout=30).stdout
            number = re.search(r"\d+(\.\d+)+", said)
            found.update({name: number[0]} if number else {})
    return found


def is_ci() -> bool:
    return os.environ.get("CI") == "true"
