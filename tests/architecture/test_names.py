"""A class name stands for one thing. The same thing on robot and operator has the same name, and is in the glossary."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
GLOSSARY = (ROOT / "docs" / "reference" / "glossary.md").read_text()
PACKAGES = [ROOT / "mosaic_core", *sorted(ROOT.glob("plugins/*/mosaic_*"))]

TWINS = {"ControlChannel", "DataPort", "FurtherOffers"}
"""The same thing on the robot and on the operator."""


@cache
def homes() -> dict[str, set[str]]:
    """The modules of every public class."""
    found = defaultdict(set)
    for package in PACKAGES:
        for path in package.rglob("*.py"):
            for node in ast.parse(path.read_text()).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].add(path.relative_to(package.parent).as_posix())
    return found


def test_a_class_name_stands_for_one_thing() -> None:
    several = {name: places for name, places in homes().items() if len(places) > 1}
    assert {name: places for name, places in several.items() if name not in TWINS} == {}
    assert several.keys() == TWINS, "what is no twin any more leaves the list"


def test_a_twin_is_once_on_the_robot_and_once_on_the_operator() -> None:
    for name in TWINS:
        sides = sorted(place.split("/")[1] for place in homes()[name])
        assert sides == ["operator", "runtime"], name


def test_what_has_one_name_on_both_sides_is_in_the_glossary() -> None:
    assert [name for name in sorted(TWINS) if f"`{name}`" not in GLOSSARY] == []


def test_every_class_that_the_glossary_names_exists() -> None:
    pages = "".join(path.read_text() for path in ROOT.glob("dashboard/packages/*/src/**/*.ts"))
    named = set(re.findall(r"`((?:[A-Z][a-z]+)+)`", GLOSSARY)) - homes().keys()
    assert {name for name in named if f"export class {name} " not in pages} == set()
