"""A name stands for one thing: a class, an alias, a module, an interface of the page.

The same thing on robot and operator has the same name, and is in the glossary.
"""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
GLOSSARY = (ROOT / "docs" / "reference" / "glossary.md").read_text()
CORE = ROOT / "mosaic_core"
PACKAGES = [CORE, *sorted(ROOT.glob("plugins/*/mosaic_*"))]

TWINS = {"ControlChannel", "DataPort", "FurtherOffers"}
"""The same thing on the robot and on the operator."""
OF_EACH_MACHINE = {"Effect", "Event", "Phase"}
"""What each machine calls its own: whoever imports one says whose, as in ``machine.Event``."""
WITH_AN_ORDER = {"Role"}
"""A word of the wire, and the same word in the server, which also orders it."""
ON_SEVERAL_LAYERS = {
    "bulk_of_operator.py",
    "bulk_of_robot.py",
    "control_channel.py",
    "data_port.py",
    "data_tap.py",
    "further_offers.py",
    "media_tap.py",
    "signaling_socket.py",
}
"""Modules that are about the same thing: decided and done, promised and kept, on the robot and on the operator."""

PAGE_TYPE = re.compile(r"^export (?:abstract )?(?:interface|type|class) (\w+)(?! = messages\.\1$)", re.MULTILINE)
AS_ON_THE_WIRE = {"DeliveryWatch"}
"""What the page asks for, and the message by which it asks."""
AN_ALIAS = re.compile(r"_?(?:[A-Z][a-z0-9]*)+")


@cache
def homes() -> dict[str, set[str]]:
    """The modules of every class, also of those that a module keeps to itself."""
    found = defaultdict(set)
    for place, node in _statements():
        if isinstance(node, ast.ClassDef):
            found[node.name].add(place)
    return found


@cache
def alias_homes() -> dict[str, set[str]]:
    """The modules of every type alias and type variable, but for those that describe an option of a command."""
    found = defaultdict(set)
    for place, node in _statements():
        for name in _alias_in(node):
            found[name].add(place)
    return found


@cache
def _statements() -> list[tuple[str, ast.stmt]]:
    return [
        (path.relative_to(package.parent).as_posix(), node)
        for package in PACKAGES
        for path in sorted(package.rglob("*.py"))
        for node in ast.parse(path.read_text()).body
    ]


def _alias_in(node: ast.stmt) -> Iterator[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    value = getattr(node, "value", None)
    of_a_command = value is not None and "typer." in ast.unparse(value)
    for target in targets:
        if isinstance(target, ast.Name) and AN_ALIAS.fullmatch(target.id) and not target.id.isupper():
            yield from () if of_a_command else (target.id,)


def several(places: Mapping[str, set[str]]) -> dict[str, set[str]]:
    return {name: found for name, found in places.items() if len(found) > 1}


def test_a_class_name_stands_for_one_thing() -> None:
    twice = several(homes())
    assert {name: places for name, places in twice.items() if name not in TWINS} == {}
    assert twice.keys() == TWINS, "what is no twin any more leaves the list"


def ambiguous_aliases(aliases: Mapping[str, set[str]], classes: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """The aliases whose name means something else too: in the core, in the alias's own distribution, or as a class of
    the core. Two plugins, of which a reader has one before him, may each have a ``Triple``.
    """
    found = {}
    for name, places in aliases.items():
        all_places = places | classes.get(name, set())
        distributions = Counter(place.split("/")[0] for place in all_places)
        if len(all_places) > 1 and ("mosaic_core" in distributions or max(distributions.values()) > 1):
            found[name] = all_places
    return found


def test_an_alias_stands_for_one_thing() -> None:
    assert ambiguous_aliases(alias_homes(), homes()).keys() == OF_EACH_MACHINE | WITH_AN_ORDER


def test_an_ambiguous_alias_is_found_beside_another_and_beside_a_class() -> None:
    aliases = {"Triple": {"mosaic_a/x.py", "mosaic_b/x.py"}, "Told": {"mosaic_core/x.py", "mosaic_core/y.py"}}
    aliases["Pose"] = {"mosaic_a/x.py"}
    assert ambiguous_aliases(aliases, {"Pose": {"mosaic_core/z.py"}}).keys() == {"Told", "Pose"}
    assert alias_homes()["Preset"] == {"mosaic_core/machines/media/rung_ladder.py"}


def test_a_module_of_the_core_has_a_name_of_its_own() -> None:
    counts = Counter(path.name for path in CORE.rglob("*.py") if path.name != "__init__.py")
    assert {name for name, number in counts.items() if number > 1} == ON_SEVERAL_LAYERS


def test_a_type_of_the_page_stands_for_one_thing() -> None:
    found = defaultdict(set)
    for path in sorted(ROOT.glob("dashboard/packages/*/src/**/*.ts*")):
        for name in PAGE_TYPE.findall(path.read_text()) if ".test." not in path.name else ():
            found[name].add(path.relative_to(ROOT).as_posix())
    assert found["PeerAttempt"]
    twice = several(found)
    assert {name: places for name, places in twice.items() if name not in AS_ON_THE_WIRE} == {}
    assert twice.keys() == AS_ON_THE_WIRE


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
