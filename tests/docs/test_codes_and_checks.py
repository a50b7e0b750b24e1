"""Whatever core, server or a plugin of ours can say as a code, and whatever the doctor calls a check, stands in the
reference: collected from the sources, so that nobody has to remember it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from mosaic_core.words.codes import REASONS

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "docs" / "reference"
SOURCES = [
    path for pattern in ("mosaic_core/**/*.py", "plugins/*/mosaic_*/**/*.py") for path in sorted(ROOT.glob(pattern))
]
DOTTED = re.compile(r"[a-z][a-z0-9-]*(?:\.[a-z][a-z0-9_]*)+")
IN_CODE = re.compile(r"`([A-Za-z][\w-]*(?:\.[\w-]+)+)`")
FILE_ENDINGS = (".yaml", ".json", ".log", ".toml", ".sqlite3")
FINDERS = ("failed", "warned", "passed", "skipped")
EVENTS = {"lease.granted", "lease.ended", "peer.connected", "command.accepted", "command.refused"}
"""Words of a robot's journal: what happened, not why something did not."""


@cache
def nodes() -> tuple[tuple[str, ast.AST], ...]:
    parsed = ((str(path.relative_to(ROOT)), ast.parse(path.read_text("utf-8"))) for path in SOURCES)
    return tuple((file, node) for file, tree in parsed for node in ast.walk(tree))


def texts(node: ast.AST) -> Iterator[str]:
    yield from (one.value for one in ast.walk(node) if isinstance(one, ast.Constant) and isinstance(one.value, str))


def documented(page: str) -> set[str]:
    return set(IN_CODE.findall((REFERENCE / page).read_text("utf-8")))


def patterned(node: ast.JoinedStr) -> str:
    """``camera.X`` of ``f"camera.{label}"``: lower-case letters are written out, X stands for anything."""
    parts = (str(one.value) if isinstance(one, ast.Constant) else "X" for one in node.values)
    return "".join(parts)


def codes_given() -> Iterator[tuple[str, str]]:
    """What stands where only a code may stand."""
    for file, node in nodes():
        if not isinstance(node, ast.Call):
            continue
        called = getattr(node.func, "id", getattr(node.func, "attr", ""))
        given = [keyword.value for keyword in node.keywords if keyword.arg == "code"]
        given += node.args[1:2] if called in FINDERS[:2] else node.args[:1] if called == "Refused" else []
        for text in (text for one in given for text in texts(one)):
            if DOTTED.fullmatch(text):
                yield file, text


def test_every_code_that_is_given_is_in_the_reference() -> None:
    given, told = set(codes_given()), documented("reason-codes.md")
    assert {"ros2.goal_rejected", "mavlink.wrong_mode", "arm.free", "recorder.busy"} <= {code for _, code in given}
    assert sorted((file, code) for file, code in given if code not in REASONS or code not in told) == []


def test_whatever_looks_like_a_code_or_check_is_in_the_reference() -> None:
    """Also what travels through variables and tables before it is said."""
    checks = documented("doctor-checks.md")
    known = {*REASONS, *checks, *documented("wire.md"), *EVENTS}
    begins = {name.partition(".")[0] for name in (*REASONS, *checks)}
    begins |= {path.name.removeprefix("mosaic-") for path in (ROOT / "plugins").iterdir()}
    said = {
        (file, node.value)
        for file, node in nodes()
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and DOTTED.fullmatch(node.value)
    }
    of_ours = {(file, text) for file, text in said if text.partition(".")[0] in begins}
    assert {"mavlink.denied", "camera.devices", "machine.wifi"} <= {text for _, text in of_ours}
    assert sorted(one for one in of_ours if one[1] not in known and not one[1].endswith(FILE_ENDINGS)) == []


def test_every_check_of_the_doctor_is_in_the_reference_and_none_beside() -> None:
    named, patterns = set[str](), set[str]()
    for file, node in nodes():
        if "doctor" in file or "diagnosis" in file:
            named |= {text for text in [getattr(node, "value", None)] if isinstance(text, str)}
            patterns |= {patterned(node)} if isinstance(node, ast.JoinedStr) else set()
    told = documented("doctor-checks.md")
    of_names = {name for name in told if any(map(str.isupper, name.split(".")))}
    assert sorted(told - of_names - named) == [], "checks that nobody makes any more"
    for name in of_names:
        assert any(_fits(name, pattern) for pattern in patterns), name
    made = {pattern for pattern in patterns if re.fullmatch(r"[a-zX]+(\.[a-z]+)*\.X", pattern)}
    assert sorted(one for one in made if not any(_fits(name, one) for name in (*of_names, *told))) == []


def _fits(name: str, pattern: str) -> bool:
    return re.fullmatch(re.escape(pattern).replace("X", r"[\w.]+"), name) is not None
