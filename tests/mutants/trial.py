"""Runs tests against a mutant in a forked process: nothing is written to disk, and what does not depend on the mutated
module is imported once, before the fork.

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
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, Literal

import pytest
from hypothesis import Phase, settings

Verdict = Literal["alive", "killed", "time-out", "unreached"]
LEAST_CPU_S = 10
LEAST_WALL_S = 30.0
TIMES = 4
"""A mutant may take this many times as long as the tests take without it; a busy machine is no killer."""
MEMORY_BYTES = 4 << 30


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


def tried(path: Path, name: str, source: str, tests: Sequence[str], limits: Limits, first: Sequence[str] = ()) -> Trial:
    """Run ``tests`` in a child in which module ``name`` has ``source``; ``first``: names of tests to begin with."""
    start_s = time.monotonic()
    with tempfile.TemporaryFile("w+b") as output, tempfile.TemporaryFile("w+") as notes:
        child = os.fork()
        if child == 0:
            plugin = TrialPlugin(first, notes.fileno())
            _become(MutantFinder(path, name, source, notes.fileno()), plugin, tests, limits, output.fileno())
        status, usage = _waited(child, start_s + limits.wall_s)
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


def _become(finder: MutantFinder, plugin: TrialPlugin, tests: Sequence[str], limits: Limits, output: int) -> None:
    """The child: it never returns."""
    code = 3
    try:
        os.dup2(output, 1)
        os.dup2(output, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu_s, limits.cpu_s + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
        sys.meta_path.insert(0, finder)
        words = ["-x", "-q", "--assert=plain", "--tb=line", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist"]
        code = int(pytest.main([*words, "--hypothesis-seed=0", *tests], plugins=[plugin]))
        sys.stdout.flush()
    except BaseException:
        os.write(2, traceback.format_exc().encode())
        raise
    finally:
        os._exit(code)


class TrialPlugin:
    """Quick tests and those that failed before go first. Of a property it counts whether it fails: no shrinking, no
    data base, the same examples each time."""

    def __init__(self, first: Sequence[str], notes: int) -> None:
        self._rank = {name: place for place, name in enumerate(first)}
        self._notes = notes
        self._durations_s: dict[str, float] = {}

    def pytest_configure(self) -> None:
        """After the conftest files, which load a profile of their own."""
        settings.register_profile(
            "mutants", deadline=None, database=None, phases=(Phase.explicit, Phase.generate), print_blob=False
        )
        settings.load_profile("mutants")

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items.sort(key=lambda item: self._rank.get(item.nodeid, len(self._rank)))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            _note(self._notes, killer=report.nodeid)
        elif report.when == "call":
            self._durations_s[report.nodeid] = report.duration

    def pytest_sessionfinish(self) -> None:
        _note(self._notes, durations_s=self._durations_s)


def _note(notes: int, **told: Any) -> None:
    os.write(notes, json.dumps(told).encode() + b"\n")


class MutantFinder(importlib.abc.MetaPathFinder):
    """Gives the mutated source for one module, and tells which others were complete before anybody asked for it."""

    def __init__(self, path: Path, name: str, source: str, notes: int) -> None:
        self._path, self._name, self._source, self._notes = path, name, source, notes

    def find_spec(self, name: str, path: Any, target: ModuleType | None = None) -> Any:
        if name != self._name:
            return None
        complete = [name for name, module in list(sys.modules.items()) if _is_complete(name, module)]
        _note(self._notes, imports=complete)
        return importlib.util.spec_from_file_location(name, self._path, loader=_Loader(name, self._path, self._source))


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: Path, source: str) -> None:
        super().__init__(name, str(path))
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._source, self.path, "exec", dont_inherit=True)


def _is_complete(name: str, module: ModuleType | None) -> bool:
    spec = getattr(module, "__spec__", None)
    if spec is None or getattr(spec, "_initializing", False) or spec.name != name:
        return False
    return not name.startswith(("tests", "test_", "conftest", "plugins")) and "conftest" not in name


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
