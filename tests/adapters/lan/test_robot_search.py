"""The search for robots, where it can't be made; what it finds stands in the tests of the robot's own server."""

from __future__ import annotations

import sys

import pytest

from mosaic_core.adapters.lan.robot_search import announced_robots
from mosaic_core.words.errors import SignalingError


async def test_without_the_package_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zeroconf", None)
    with pytest.raises(SignalingError) as caught:
        await announced_robots(0.1)
    assert caught.value.code == "lan.search"
    assert 'pip install "mosaic-core[lan]"' in caught.value.cure


async def test_without_a_network_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(**_: object) -> None:
        raise OSError("no interface")

    monkeypatch.setattr("zeroconf.asyncio.AsyncZeroconf", no_network)
    with pytest.raises(SignalingError, match="no interface") as caught:
        await announced_robots(0.1)
    assert caught.value.code == "lan.search"
