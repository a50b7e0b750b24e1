"""The page on the architecture is true: its tree is the tree, and every function it names is in that file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "topics" / "architecture.md").read_text()
PLACES = re.compile(r'\["([^"<]+)<br>(\w+)"\]|`([^`]+/[^`]+\.tsx?|[^`]+/[^`]+\.py)` `(\w+)`')
BOXES = sorted({(one[0] or one[2], one[1] or one[3]) for one in PLACES.findall(PAGE)})
CORE = ROOT / "mosaic_core"


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
