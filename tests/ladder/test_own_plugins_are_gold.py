"""What we ship ourselves, show as an example or write for others stands on the highest rung."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Set
from pathlib import Path

import pytest

from mosaic_core.cli.plugin.scaffold import KINDS, NewPlugin
from mosaic_core.ladder.climb import RULES, climb
from mosaic_core.ladder.shipment import found_shipments
from mosaic_core.testing.distributions import forget_modules_of

ROOT = Path(__file__).parents[2]
PLUGINS = sorted(
    path.parent.name for path in ROOT.glob("plugins/*/pyproject.toml") if '"mosaic.connectors"' in path.read_text()
)
STILL_BELOW = {"mosaic-ros2": {"type-name", "explained", "param-units", "message-units"}}
"""Rules that a plugin of ours does not keep: seven types of ROS 2 are called as original robots' files call them, stand
in no example, and take and send what those took and sent; the publisher's example has its limits beside its params."""
RESTARTS = 2
"""Enough to see whether each one leaves something."""


@pytest.fixture
def clean_path() -> Iterator[None]:
    before = list(sys.path)
    yield
    sys.path[:] = before


async def missing(word: str, *, but_for: Set[str] = frozenset()) -> list[str]:
    """What keeps a plugin from gold, in words."""
    (shipment,) = found_shipments([word])
    only = {rule.name for rule in RULES} - but_for
    return [
        f"{one.subject} {one.rule.name}: {one.verdict} {one.why_not} {[f'{f.place}: {f.message}' for f in one.faults]}"
        async for one in climb(shipment, restarts=RESTARTS, only=only)
        if one.verdict in ("failed", "not judged")
    ]


@pytest.mark.parametrize("name", PLUGINS)
async def test_our_plugins_are_gold(name: str) -> None:
    assert await missing(name, but_for=STILL_BELOW.get(name, frozenset())) == []


@pytest.mark.usefixtures("clean_path")
async def test_the_example_is_gold() -> None:
    # A lamp with a time-out of 5 s takes the drill 8 s; it moves nothing.
    assert await missing(str(ROOT / "examples" / "third-party-connector"), but_for={"safety-drill"}) == []


@pytest.mark.usefixtures("clean_path")
@pytest.mark.parametrize("kind", KINDS)
async def test_a_new_plugin_is_gold(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / f"acme-new-{kind}"
    NewPlugin(folder.name, kind).write(folder)
    assert await missing(str(folder)) == []
    forget_modules_of(folder)
