"""The fastest event loop there is, and the standard one where there is none."""

from __future__ import annotations

import asyncio
import gc
import sys
from collections.abc import Iterator

import pytest

from mosaic_core.adapters.machine.event_loop import SWITCH_INTERVAL_S, keep_what_is_loaded, loop_factory, run_event_loop


@pytest.fixture(autouse=True)
def switch_interval() -> Iterator[None]:
    before_s = sys.getswitchinterval()
    yield
    sys.setswitchinterval(before_s)


async def _name_of_loop() -> str:
    return type(asyncio.get_running_loop()).__module__


def test_uvloop_runs_the_program() -> None:
    pytest.importorskip("uvloop")
    assert run_event_loop(_name_of_loop()).startswith("uvloop")


def test_without_uvloop_asyncio_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert loop_factory() is None
    assert run_event_loop(_name_of_loop()).startswith("asyncio")


def test_threads_of_a_program_take_short_turns() -> None:
    run_event_loop(_name_of_loop())
    assert sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)


def test_the_collector_leaves_alone_what_is_loaded() -> None:
    gc.unfreeze()  # what the suite has set aside
    keep_what_is_loaded()  # and it stays so: the tests that follow would wait for the collector
    assert gc.get_freeze_count() > 1000
    assert len(gc.get_objects()) < gc.get_freeze_count()
