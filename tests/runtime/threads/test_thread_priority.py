"""The safety threads come before ordinary ones where the system allows it, and do without where it doesn't."""

from __future__ import annotations

import os
import sys
import threading
from typing import Any

import pytest

from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.threads.thread_priority import run_first


def on_a_thread(work: Any) -> Any:
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(work()))
    thread.start()
    thread.join(5)
    return found[0]


def is_first() -> bool:
    return bool(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR)


@pytest.mark.skipif(sys.platform != "linux", reason="real-time threads are Linux")
def test_a_thread_that_may_comes_first_and_no_other_one() -> None:
    def work() -> tuple[bool, bool, bool]:
        return run_first(), is_first(), on_a_thread(is_first)

    is_allowed, came_first, child_too = on_a_thread(work)
    assert came_first is is_allowed
    assert not child_too
    assert not is_first(), "this thread never asked for it"


@pytest.mark.skipif(sys.platform != "linux", reason="real-time threads are Linux")
def test_where_it_is_not_allowed_everything_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert on_a_thread(run_first) is False


def test_the_threads_that_run_safe_actions_ask_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(
        "mosaic_core.runtime.commands.safety_watchdog.run_first", lambda: asked.append(threading.current_thread().name)
    )
    watchdog = SafetyWatchdog()
    watchdog.start()
    watchdog.close()
    for thread in threading.enumerate():
        if thread.name.startswith("mosaic-safety"):
            thread.join(5)
    assert asked
    assert all(name.startswith("mosaic-safety") for name in asked)
