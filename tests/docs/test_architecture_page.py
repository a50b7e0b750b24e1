"""The page on the architecture is true: its tree is the tree, and every function it names is in that file."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import Files

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "topics" / "architecture.md").read_text()
PLACES = re.compile(r'\["([^"<]+)<br>(\w+)"\]|`([^`]+/[^`]+\.tsx?|[^`]+/[^`]+\.py)` `(\w+)`')
BOXES = sorted({(one[0] or one[2], one[1] or one[3]) for one in PLACES.findall(PAGE)})
CORE = ROOT / "mosaic_core"


@pytest.fixture
def own_mermaid() -> ModuleType:
    """The hook of the site, which is no module of a package."""
    spec = importlib.util.spec_from_file_location("own_mermaid", ROOT / "docs" / "own_mermaid.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rooms() -> set[str]:
    return {path.name for path in CORE.glob("*/*") if path.is_dir() and any(path.glob("*.py"))}


@pytest.mark.parametrize(("file", "name"), BOXES)
def test_a_box_is_a_function_of_its_file(file: str, name: str) -> None:
    defined = re.compile(
        rf"(?:def|class|function|const) {name}\b|^  (?:private |protected |readonly |async )*{name}\b", re.M
    )
    assert defined.search((ROOT / file).read_text()), f"{file} defines no {name}"


def test_the_tree_names_every_layer_and_room_and_no_other() -> None:
    tree = PAGE.split("```text\nmosaic_core/\n")[1].split("```")[0]
    named = set(re.findall(r"\b(\w+)/", tree))
    layers = {path.name for path in CORE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    assert named == layers | rooms()


def test_five_walks_are_drawn() -> None:
    assert PAGE.count("```mermaid") == 5


def test_a_page_with_diagrams_brings_the_script_that_draws_them(own_mermaid: ModuleType) -> None:
    page = SimpleNamespace(url="topics/architecture/")
    drawn = own_mermaid.on_post_page(f"<head></head>{own_mermaid.DIAGRAM}</pre>", page=page, config=None)
    assert drawn.startswith(f'<head><script src="../../{own_mermaid.PLACE}"></script></head>')
    assert own_mermaid.on_post_page("<head></head>", page=page, config=None) == "<head></head>"


def test_without_that_script_no_site_is_built(
    own_mermaid: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(own_mermaid, "SOURCE", tmp_path / "mermaid.js")
    with pytest.raises(PluginError, match="npm ci"):
        own_mermaid.on_files(Files([]), config=None)
