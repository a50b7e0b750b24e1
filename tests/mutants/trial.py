"""Runs tests against a mutant in a forked process: nothing is written to disk, and what does not depend on the mutated
module is imported once, before the fork. Where only functions have changed, even the collected tests are there already,
and the fork gives those functions their new code.

cosmic-ray's own runner writes each mutant into the working tree and starts Python anew for it: some three seconds each
with our imports, and a tree that nobody may touch meanwhile.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import inspect
import itertools
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Literal

import pytest
from hypothesis import Phase, settings

Codes = list[tuple[FunctionType, CodeType]]
Verdict = Literal["alive", "killed", "time-out", "unreached"]
LEAST_CPU_S = 10
LEAST_WALL_S = 30.0
TIMES = 4
"""A mutant may take this many times as long as the tests take without it; a busy machine is no killer."""
MEMORY_BYTES = 4 << 30
PYTEST_WORDS = (
    *("-x", "-q", "--assert=plain", "--tb=line", "--no-header", "--hypothesis-seed=0"),
    *("-p", "no:cacheprovider"),
)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a mutant that loops or waits for ever is ended by."""

    cpu_s: int = 120
    wall_s: float = 300.0


@dataclass(frozen=True, slots=True)
class Trial:
    verdict: Verdict
    wall_s: float
    cpu_s: float
    output: str
    imports: list[str] = field(default_factory=list)
    """Modules that may be imported before the fork: none of them needs the mutated one."""
    durations_s: dict[str, float] = field(default_factory=dict)
    """Of each test that passed."""
    killer: str = ""
    """The test that failed."""


def module_name(path: str) -> str:
    """``plugins/mosaic-server/mosaic_server/x.py`` → ``mosaic_server.x``."""
    parts = Path(path).with_suffix("").parts
    return ".".join(parts[2:] if parts[0] == "plugins" else parts).removesuffix(".__init__")


def limits_after(baseline: Trial) -> Limits:
    return Limits(int(max(LEAST_CPU_S, TIMES * baseline.cpu_s)), max(LEAST_WALL_S, TIMES * baseline.wall_s))


def preload(names: Sequence[str]) -> None:
    for name in names:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    gc.freeze()  # pytest collects garbage with every run; what is here already is none


def tried(path: Path, name: str, source: str, tests: Sequence[str], limits: Limits) -> Trial:
    """Collect and run ``tests`` in a child in which module ``name`` has ``source``."""

    def child(notes: int, output: int) -> None:
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.meta_path.insert(0, MutantFinder(path, name, source, notes))
        os._exit(int(pytest.main([*PYTEST_WORDS, *tests], plugins=[TrialPlugin(notes)])))

    return _forked_trial(child, limits)


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


def _forked_trial(child: Callable[[int, int], None], limits: Limits) -> Trial:
    start_s = time.monotonic()
    with tempfile.TemporaryFile("w+b") as output, tempfile.TemporaryFile("w+") as notes:
        number = os.fork()
        if number == 0:
            try:
                resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu_s, limits.cpu_s + 5))
                resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
                child(notes.fileno(), output.fileno())
            except BaseException:  # noqa: BLE001 - the child ends here, whatever it was
                os.write(output.fileno(), traceback.format_exc().encode())
            finally:
                os._exit(pytest.ExitCode.INTERNAL_ERROR)
        status, usage = _waited(number, start_s + limits.wall_s)
        output.seek(0)
        notes.seek(0)
        told: dict[str, Any] = {}
        for line in notes:
            told |= json.loads(line)
        text = output.read().decode(errors="replace")
    verdict = _verdict(status, is_reached="imports" in told)
    return Trial(verdict, time.monotonic() - start_s, usage.ru_utime + usage.ru_stime, text, **told)


def _verdict(status: int | None, *, is_reached: bool) -> Verdict:
    if status is None or os.WIFSIGNALED(status):
        return "time-out"
    code = os.waitstatus_to_exitcode(status)
    if code in (pytest.ExitCode.USAGE_ERROR, pytest.ExitCode.NO_TESTS_COLLECTED) or not is_reached:
        return "unreached"
    return "alive" if code == 0 else "killed"


def _waited(child: int, until_s: float) -> tuple[int | None, resource.struct_rusage]:
    pause_s = 0.01
    while time.monotonic() < until_s:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            return status, usage
        time.sleep(pause_s)
        pause_s = min(0.1, pause_s * 1.2)
    os.kill(child, signal.SIGKILL)
    return None, os.wait4(child, 0)[2]


class TrialPlugin:
    """Notes what pytest does. Of a property it counts whether it fails: no shrinking, no data base, the same examples
    each time."""

    def __init__(self, notes: int, work: Callable[[Collected], None] | None = None) -> None:
        self._work = work
        self.has_worked = False
        self.notes = notes
        self._durations_s: dict[str, float] = {}

    def pytest_configure(self) -> None:
        """After the conftest files, which load a profile of their own."""
        settings.register_profile(
            "mutants", deadline=None, database=None, phases=(Phase.explicit, Phase.generate), print_blob=False
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

        trial = _forked_trial(child, limits)
        items = self._session.items
        if trial.durations_s and trial.verdict == "alive" and not codes:
            items.sort(key=lambda item: trial.durations_s.get(item.nodeid, 0.0))
        items.sort(key=lambda item: item.nodeid != trial.killer)
        return trial


def changes_functions(path: Path, original: str, mutated: str) -> bool:
    """Whether the mutant changes functions alone, nothing that runs at import."""
    return _changed(compile(original, str(path), "exec"), compile(mutated, str(path), "exec")) is not None


def functions_of(path: Path) -> list[FunctionType]:
    """All functions that the import of the module at ``path`` has made."""
    gc.unfreeze()
    return [one for one in gc.get_objects() if isinstance(one, FunctionType) and one.__code__.co_filename == str(path)]


def swapped(path: Path, live: list[FunctionType], original: str, mutated: str) -> Codes:
    """Those of the ``live`` functions that the mutant changes, with their new code."""
    changed = _changed(compile(original, str(path), "exec"), compile(mutated, str(path), "exec")) or []
    return [(one, new) for one in live for old, new in changed if one.__code__ == old]


def _changed(before: CodeType, after: CodeType) -> list[tuple[CodeType, CodeType]] | None:
    """Pairs of functions; ``None`` if the code around them differs."""
    old, new = (tuple(one for one in code.co_consts if isinstance(one, CodeType)) for code in (before, after))
    if _own(before) != _own(after) or len(old) != len(new):
        return None
    pairs: list[tuple[CodeType, CodeType]] = []
    for one, other in zip(old, new, strict=True):
        if one.co_flags & inspect.CO_OPTIMIZED:
            pairs += [(one, other)] if one != other else []
        elif (inner := _changed(one, other)) is None:
            return None
        else:
            pairs += inner
    return pairs


def _own(code: CodeType) -> tuple[object, ...]:
    """What a module or the body of a class does itself."""
    constants = [repr(one) for one in code.co_consts if not isinstance(one, CodeType)]
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_qualname


def _note(notes: int, **told: Any) -> None:
    os.write(notes, json.dumps(told).encode() + b"\n")


class MutantFinder(importlib.abc.MetaPathFinder):
    """Gives the mutated source for one module, and tells which others were complete before anybody asked for it."""

    def __init__(self, path: Path, name: str, source: str, notes: int) -> None:
        self._path, self._name, self._source, self._notes = path, name, source, notes

    def find_spec(self, name: str, path: Any, target: ModuleType | None = None) -> Any:
        if name != self._name:
            return None
        complete = [name for name in list(sys.modules) if _is_complete(name)]
        _note(self._notes, imports=complete)
        return importlib.util.spec_from_file_location(name, self._path, loader=_Loader(name, self._path, self._source))


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: Path, source: str) -> None:
        super().__init__(name, str(path))
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._source, self.path, "exec", dont_inherit=True)


def _is_complete(name: str) -> bool:
    """It and the packages around it, which are imported with it."""
    parents = [name.rsplit(".", depth)[0] for depth in range(name.count(".") + 1)]
    specs = [getattr(sys.modules.get(one), "__spec__", None) for one in parents]
    if any(spec is None or getattr(spec, "_initializing", False) for spec in specs):
        return False
    return not name.startswith(("tests", "test_", "plugins")) and "conftest" not in name


@contextlib.contextmanager
def forked() -> Iterator[bool]:
    """``True`` in a child that ends with the block, ``False`` in the parent, which waits for it."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            yield True
            code = 0
        finally:
            sys.stdout.flush()
            os._exit(code)
    yield False
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0:
        raise SystemExit("a part of the run ended with an error; see above")
