"""What we write for others stands on the highest rung, and what we ship ourselves is held to it by its own tests."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mosaic_core.cli.plugin.scaffold import KINDS, NewPlugin
from mosaic_core.ladder.missing import missing_to_gold
from mosaic_core.testing.distributions import forget_modules_of
from tests.ladder.conftest import GoodPlugin

ROOT = Path(__file__).parents[2]
PLUGINS = [
    path.parent
    for path in sorted(ROOT.glob("plugins/*/pyproject.toml"))
    if '"mosaic.connectors"' in path.read_text("utf-8")
]


@pytest.mark.parametrize("folder", [*PLUGINS, ROOT / "examples" / "third-party-connector"], ids=lambda one: one.name)
def test_each_distribution_asks_for_gold_in_tests_of_its_own(folder: Path) -> None:
    """Here they would all be asked one after the other, and each one more would make this folder slower."""
    texts = [file.read_text("utf-8") for file in folder.glob("tests/**/test_*.py")]
    assert any("await missing_to_gold(" in text for text in texts)


@pytest.fixture
def clean_path() -> Iterator[None]:
    before = list(sys.path)
    yield
    sys.path[:] = before


@pytest.mark.usefixtures("clean_path")
@pytest.mark.parametrize("kind", KINDS)
async def test_a_new_plugin_is_gold(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / f"acme-new-{kind}"
    NewPlugin(folder.name, kind).write(folder)
    assert await missing_to_gold(str(folder)) == []
    forget_modules_of(folder)


async def test_what_is_missing_to_gold_is_told_with_its_place_and_what_is_not_asked_is_not(plugin: GoodPlugin) -> None:
    plugin.spoil("pyproject.toml", 'license = "Apache-2.0"\n', "")
    (told,) = await missing_to_gold(str(plugin.folder), but_for=("safety-drill",))
    assert told.startswith("acme-gauge licence: failed")
    assert f"{plugin.folder / 'pyproject.toml'}: no licence is named" in told
    assert await missing_to_gold(str(plugin.folder), but_for=("safety-drill", "licence")) == []
