"""Every distribution says from which version on it works with what it needs: the same in all of them, and no version
with a known hole. Asks nobody: it holds without a network."""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from mosaic_core.cli.plugin.scaffold import KINDS
from release.requirements import PROJECTS, ROOT, name_of, own_names, read

ALL = [*PROJECTS, *sorted(path.parent for path in (ROOT / "examples").glob("*/pyproject.toml"))]
HOLES = tomllib.loads((ROOT / "release" / "holes.toml").read_text("utf-8"))


def asked() -> Iterator[tuple[str, str]]:
    """Everything that a distribution of ours needs, an extra or group of it, or what makes it; and by whom."""
    for project in ALL:
        content, where = read(project), str(project.relative_to(ROOT))
        extras = content["project"].get("optional-dependencies", {}).values()
        groups = content.get("dependency-groups", {}).values()
        lines = [*content["project"].get("dependencies", []), *content["build-system"]["requires"]]
        lines += [line for some in (*extras, *groups) for line in some if isinstance(line, str)]
        yield from ((where, line) for line in lines)
    yield from ((f"mosaic plugin new --{name}", line) for name, kind in KINDS.items() for line in kind.dependencies)


def lower_bound(line: str) -> Version | None:
    bounds = [one.version for one in Requirement(line).specifier if one.operator in (">=", "==", "~=", ">")]
    return max(map(Version, bounds), default=None)


def test_every_dependency_has_a_lower_bound() -> None:
    every = list(asked())
    assert len(every) > 100
    ours = {*own_names(), "acme-workbench"}
    assert [one for one in every if lower_bound(one[1]) is None and name_of(one[1]) not in ours] == []


def test_the_same_package_has_the_same_lower_bound_everywhere() -> None:
    bounds: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for where, line in asked():
        bounds[name_of(line)][str(lower_bound(line))].append(where)
    assert {name: dict(found) for name, found in bounds.items() if len(found) > 1} == {}


@pytest.mark.parametrize("name", HOLES)
def test_no_lower_bound_lets_in_a_known_hole(name: str) -> None:
    mended_in = Version(HOLES[name]["mended_in"])
    found = [(where, line) for where, line in asked() if name_of(line) == name]
    assert found, f"{name} is none of our dependencies any more"
    assert [one for one in found if (bound := lower_bound(one[1])) is None or bound < mended_in] == []


def test_what_stands_beside_a_bound_is_in_the_list_of_holes() -> None:
    known = {one for hole in HOLES.values() for one in hole["advisories"]}
    beside = {one for project in ALL for one in re.findall(r"CVE-\d{4}-\d+", text_of(project))}
    assert beside
    assert beside - known == set()


def text_of(project: Path) -> str:
    return (project / "pyproject.toml").read_text("utf-8")
