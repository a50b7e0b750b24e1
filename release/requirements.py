"""What the distributions of this repository and its tools ask for, as their pyprojects say it, without each other."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
LOCKS = ROOT / "locks"
PROJECTS = [ROOT, *sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))]
NAME = re.compile(r"[A-Za-z0-9][\w.-]*")
SETS = {
    "runtime": ("runtime",),
    "dev": ("runtime", "dev"),
    "release": ("release",),
    "mutants": ("mutants",),
    "ros": ("ros",),
    "node": ("node",),
    "pip": ("pip",),
    "lock": ("lock",),
}
"""Each lock file with what goes into it: dependency groups of the root's pyproject, and `runtime`, which is what all
distributions ask for with all their extras."""


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def name_of(requirement: str) -> str:
    found = NAME.match(requirement.strip())
    if found is None:
        raise ValueError(f"no name in the requirement {requirement!r}")
    return normal(found[0])


def read(project: Path) -> dict[str, Any]:
    return tomllib.loads((project / "pyproject.toml").read_text())


def own_names(projects: Iterable[Path] = PROJECTS) -> set[str]:
    """Names that are never looked up anywhere: a stranger may have registered them."""
    return {normal(read(project)["project"]["name"]) for project in projects}


def runtime(projects: Iterable[Path] = PROJECTS) -> Iterator[str]:
    """All extras too: what an extra of one distribution asks of another of ours is among that one's own."""
    for project in projects:
        table = read(project)["project"]
        yield from table.get("dependencies", [])
        for lines in table.get("optional-dependencies", {}).values():
            yield from lines


def group(name: str, root: Path = ROOT) -> Iterator[str]:
    for line in read(root)["dependency-groups"][name]:
        if isinstance(line, str):
            yield line
        else:
            yield from group(line["include-group"], root)


def wanted(lock: str) -> list[str]:
    """The lines of one lock file's input, sorted, of others' packages alone. `dev` has what builds ours as well: they
    are installed without a build environment of their own."""
    lines = {line for part in SETS[lock] for line in (runtime() if part == "runtime" else group(part))}
    if lock == "dev":
        lines |= {line for project in PROJECTS for line in read(project)["build-system"]["requires"]}
    own = own_names()
    return sorted(line for line in lines if name_of(line) not in own)
