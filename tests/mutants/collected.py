"""Runs tests by pytest against one mutant: collected anew in a child that imports the mutant, or collected once and run
again and again in children whose functions have new code."""

from __future__ import annotations

import itertools
import json
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from new_code import Codes, MutantFinder
from trial import Limits, Trial, forked_trial

PYTEST_WORDS = (
    *("-x", "-q", "--assert=plain", "--tb=line", "--no-header", "--hypothesis-seed=0"),
    *("-p", "no:cacheprovider"),
)


def tried(path: Path, name: str, source: str, tests: Sequence[str], limits: Limits) -> Trial:
    """Collect and run ``tests`` in a child in which module ``name`` has ``source``."""

    def child(notes: int, output: int) -> None:
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.meta_path.insert(0, MutantFinder(path, name, source, lambda imports: _note(notes, imports=imports)))
        os._exit(int(pytest.main([*PYTEST_WORDS, *tests], plugins=[TrialPlugin(notes)])))

    return forked_trial(child, limits)


def with_collected(tests: Sequence[str], work: Callable[[Collected], None]) -> str:
    """Collect ``tests`` in this very process and hand them to ``work``; what pytest said, if they can't be run."""
    plugin = TrialPlugin(-1, work)
    with tempfile.TemporaryFile("w+b") as output:
        before = os.dup(1)
        os.dup2(output.fileno(), 1)
        try:
            pytest.main([*PYTEST_WORDS, *tests], plugins=[plugin])
        finally:
            sys.stdout.flush()
            os.dup2(before, 1)
            os.close(before)
        output.seek(0)
        return "" if plugin.has_worked else output.read().decode(errors="replace")


class TrialPlugin:
    """Notes what pytest does. Of a property it counts whether it fails: no shrinking, no data base, the same examples
    each time, and no complaint about a slow machine, which would look like a change that was noticed."""

    def __init__(self, notes: int, work: Callable[[Collected], None] | None = None) -> None:
        self._work = work
        self.has_worked = False
        self.notes = notes
        self._durations_s: dict[str, float] = {}

    def pytest_configure(self) -> None:
        """After the conftest files, which load a profile of their own."""
        settings.register_profile(
            "mutants",
            deadline=None,
            database=None,
            phases=(Phase.explicit, Phase.generate),
            print_blob=False,
            suppress_health_check=list(HealthCheck),
        )
        settings.load_profile("mutants")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        if self._work is None:
            return None
        if session.items and not session.testsfailed:
            self._work(Collected(session, self))
            self.has_worked = True
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            _note(self.notes, killer=report.nodeid)
        elif report.when == "call":
            self._durations_s[report.nodeid] = report.duration

    def pytest_sessionfinish(self) -> None:
        if self.notes >= 0:
            _note(self.notes, durations_s=self._durations_s)


class Collected:
    """Tests that are collected; each :meth:`tried` runs them in a fork. Quick ones go first, and before them those that
    failed last: what notices one change often notices the next."""

    def __init__(self, session: pytest.Session, plugin: TrialPlugin) -> None:
        self._session, self._plugin = session, plugin

    def tried(self, codes: Codes, limits: Limits) -> Trial:
        """``codes``: what functions have instead of their own."""

        def child(notes: int, output: int) -> None:
            self._plugin.notes = notes
            _note(notes, imports=[])
            for function, code in codes:
                function.__code__ = code
            for item, following in itertools.zip_longest(self._session.items, self._session.items[1:]):
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                if self._session.shouldfail:
                    os._exit(pytest.ExitCode.TESTS_FAILED)
            self._plugin.pytest_sessionfinish()
            os._exit(pytest.ExitCode.OK)

        trial = forked_trial(child, limits)
        items = self._session.items
        if trial.durations_s and trial.verdict == "alive" and not codes:
            items.sort(key=lambda item: trial.durations_s.get(item.nodeid, 0.0))
        items.sort(key=lambda item: item.nodeid != trial.killer)
        return trial


def _note(notes: int, **told: Any) -> None:
    os.write(notes, json.dumps(told).encode() + b"\n")
