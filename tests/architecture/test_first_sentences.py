"""A module or class is introduced by what it is or does, with the noun that one would search for.

Scope ("Of one viewer."), thread ("Event loop only.") and interface ("Implements …") come after that.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = [ROOT / "mosaic_core", *sorted(ROOT.glob("plugins/*/mosaic_*"))]
PAGE_FILES = sorted(ROOT.glob("dashboard/packages/*/src/**/*.ts*"))

SCOPE = "At|By|For|From|In|Of|On|To|With|Within"
THREAD = "Any thread|Event[- ]loop|Only|Pure|Not|Never|No|Nobody|Nothing"
PASSIVE = "Called|Given|Implements|Made|Raised|Used|Written"
RIDDLE = re.compile(rf"(?:{SCOPE}|{THREAD}|{PASSIVE})\b")
NO_NOUN = re.compile(r"`|(?:As|Callable|Half|It|Make it|Open|Part|There)\b")
"""What a class must not begin with either: a parameter of it, or a word for what the reader doesn't know yet. A module
may begin with the command or the connector type that it is about.
"""
HEAD_COMMENT = re.compile(r"/\*\*((?:(?!\*/).)*)\*/", re.DOTALL)
PAGE_CLASS = re.compile(HEAD_COMMENT.pattern + r"\s*(?:export )?(?:abstract )?class (\w+)", re.DOTALL)


@cache
def introductions() -> tuple[tuple[str, str], ...]:
    """Every module and class with its docstring, read once."""
    return (*_read(), *_read_page())


def _read_page() -> Iterator[tuple[str, str]]:
    """The same of the page's files, where a class may also be introduced by the head of its file."""
    for path in PAGE_FILES:
        place, text = path.relative_to(ROOT).as_posix(), path.read_text()
        if head := HEAD_COMMENT.match(text):
            yield place, head[1].lstrip("* \n")
        for comment, name in PAGE_CLASS.findall(text):
            yield f"{place} {name}", comment.lstrip("* \n")


def _read() -> Iterator[tuple[str, str]]:
    """Every module and class with its docstring: ``("mosaic_core/…/peer.py Peer", "One operator's …")``."""
    for path in (path for package in PACKAGES for path in sorted(package.rglob("*.py"))):
        tree = ast.parse(path.read_text())
        for node in [tree, *(node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))]:
            place = path.relative_to(ROOT).as_posix()
            yield f"{place} {getattr(node, 'name', '')}".rstrip(), ast.get_docstring(node) or ""


def test_modules_and_classes_are_introduced_by_what_they_are() -> None:
    assert {place: text.splitlines()[0] for place, text in introductions() if RIDDLE.match(text)} == {}


def test_a_class_is_introduced_by_a_noun_and_by_none_of_its_parameters() -> None:
    classes = {place: text for place, text in introductions() if " " in place}
    assert {place: text.splitlines()[0] for place, text in classes.items() if NO_NOUN.match(text)} == {}


def test_the_search_for_riddles_finds_them() -> None:
    assert RIDDLE.match("Of one viewer.")
    assert RIDDLE.match("Event loop only.")
    assert not RIDDLE.match("One viewer's packets of one camera.")
    assert NO_NOUN.match("``setup_ms``: from nothing to an open data channel.")
    assert NO_NOUN.match("As the robot takes them.")
    assert not NO_NOUN.match("Asks a STUN server.")
    found = dict(introductions())
    assert found["mosaic_core/runtime/peers/peer.py Peer"] != ""
    assert found["dashboard/packages/client/src/peers/PeerAttempt.ts PeerAttempt"].startswith("Tries to reach a robot")
    assert found["dashboard/packages/widgets/src/TextLog/LogLines.ts"].startswith("Keeps the last lines")
