"""The fastest event loop there is, and the standard one where there is none."""

from __future__ import annotations

import asyncio
import sys

import pytest

from mosaic_core.adapters.event_loop import loop_factory, run_event_loop


async def _name_of_loop() -> str:
    return type(asyncio.get_running_loop()).__module__


def test_uvloop_runs_the_program() -> None:
    pytest.importorskip("uvloop")
    assert run_event_loop(_name_of_loop()).startswith("uvloop")


def test_without_uvloop_asyncio_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert loop_factory() is None
    assert run_event_loop(_name_of_loop()).startswith("asyncio")
