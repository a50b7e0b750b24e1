"""The watch over this machine's network."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core.adapters.machine import network_watch
from mosaic_core.machines.peers.network_change import NetworkView


def test_this_machine_has_addresses() -> None:
    view = network_watch.network_view()
    assert "127.0.0.1" not in view.addresses
    assert len(view.ways_out) == 2
    assert view.slept_s >= -1.0


async def test_a_change_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    views = [NetworkView(frozenset({"a"}), ("a", None))] * 2 + [NetworkView(frozenset({"b"}), ("b", None))]
    monkeypatch.setattr(network_watch, "network_view", lambda: views.pop(0) if len(views) > 1 else views[0])
    monkeypatch.setattr(network_watch, "PERIOD_S", 0.001)
    told: list[str] = []

    changed: Callable[[Any], None] = told.append
    task = asyncio.create_task(network_watch.watch_network(changed))
    async with asyncio.timeout(30):
        while not told:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
    await asyncio.sleep(0.02)
    task.cancel()
    assert told == ["moved"]
