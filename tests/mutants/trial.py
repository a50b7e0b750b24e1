"""One trial of a mutant, in a forked process: nothing is written to disk, and what does not depend on the mutated
module is imported once, before the fork.

cosmic-ray's own runner writes each mutant into the working tree and starts Python anew for it: some three seconds each
with our imports, and a tree that nobody may touch meanwhile.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
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
from typing import Any, Literal

import pytest

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


def forked_trial(child: Callable[[int, int], None], limits: Limits) -> Trial:
    """What becomes of ``child(notes, output)``, two file descriptors: it notes what a :class:`Trial` tells in lines of
    JSON, and ends with pytest's exit code."""
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
