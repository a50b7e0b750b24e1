"""Judges the licences in the bills of materials of a release against `licences.toml`.

``python -m release.licences dist``. Fails where a package is under a licence that is neither allowed nor an exception,
where it names none, and where an exception or a licence that we looked up is no longer needed; and where a distribution
of ours is without the text of its own.
"""

from __future__ import annotations

import json
import re
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_TEXT = r"[^/]+(?:\.dist-info/licenses)?/LICENSE"
"""Where a wheel has it, and a source distribution."""
RULES = Path(__file__).with_name("licences.toml")


@dataclass(frozen=True)
class Rules:
    allowed: frozenset[str]
    means: dict[str, str]
    found: dict[str, dict[str, str]]
    exceptions: dict[str, dict[str, str]]
    inside: dict[str, str]

    @classmethod
    def read(cls, path: Path = RULES) -> Rules:
        table = tomllib.loads(path.read_text())
        return cls(frozenset(table["allowed"]), *(table[one] for one in ("means", "found", "exceptions", "inside")))


def full_name(component: dict[str, Any]) -> str:
    """With the scope of an npm package: `@mosaic/react` is not `react`."""
    scope = re.match(r"pkg:npm/%40([^/]+)/", component.get("purl", ""))
    name = str(component["name"])
    return f"@{scope[1]}/{name}" if scope and not name.startswith("@") else name


def names_of(component: dict[str, Any]) -> list[str]:
    """Expressions as they are; of single licences the identifier, or the name where there is none. A package that names
    an identifier and repeats it as a classifier means the same twice."""
    entries = component.get("licenses", [])
    expressions = [entry["expression"] for entry in entries if "expression" in entry]
    licences = [entry["license"] for entry in entries if "license" in entry]
    return [*expressions, *(licence.get("id") or licence["name"] for licence in licences)]


def is_allowed(expression: str, allowed: frozenset[str] | set[str]) -> bool:
    """Reads an SPDX expression: of `OR` one part must be allowed, of `AND` all; `AND` binds closer."""
    text = expression.strip()
    while (inner := re.search(r"\(([^()]*)\)", text)) is not None:
        verdict = "yes" if is_allowed(inner[1], allowed) else "no"
        text = f"{text[: inner.start()]}{verdict}{text[inner.end() :]}"
    parts = [re.split(r"\s+AND\s+", part) for part in re.split(r"\s+OR\s+", text)]
    return any(all(one.strip() in allowed or one.strip() == "yes" for one in part) for part in parts)


def wrong(components: list[dict[str, Any]], rules: Rules) -> Iterator[str]:
    """One sentence for each package that may not be there as it is."""
    there = {full_name(component) for component in components}
    for component in components:
        name = full_name(component)
        exception = rules.exceptions.get(name)
        licences = [rules.means.get(licence, licence) for licence in names_of(component)]
        also = {exception["licence"]} if exception else set()
        is_named = bool(licences) and all(is_allowed(licence, rules.allowed) for licence in licences)
        if name in rules.found and is_named:
            yield f"{name} now names {' and '.join(licences)} itself: take away what was found"
        elif name in rules.found:
            licences = [rules.found[name]["licence"]]
        if not licences:
            yield f"{name} names no licence"
        elif all(is_allowed(licence, rules.allowed) for licence in licences) and exception:
            yield f"{name} is now under {' and '.join(licences)}: take its exception away"
        elif not all(is_allowed(licence, rules.allowed | also) for licence in licences):
            yield f"{name} is under {' and '.join(licences)}, which is not allowed"
    yield from (f"{name} has an exception and is not there any more" for name in rules.exceptions.keys() - there)
    yield from (f"{name} has a licence found for it and is not there any more" for name in rules.found.keys() - there)


def without_text(folder: Path) -> Iterator[str]:
    """Names of wheels and source distributions that do not carry the text of their licence."""
    for path in sorted(folder.iterdir()):
        if path.suffix == ".whl":
            with zipfile.ZipFile(path) as wheel:
                names = wheel.namelist()
        elif path.name.endswith(".tar.gz"):
            with tarfile.open(path) as sources:
                names = sources.getnames()
        else:
            continue
        if not any(re.fullmatch(_TEXT, name) for name in names):
            yield path.name


def main(folder: Path) -> int:
    bills = [json.loads(path.read_text()) for path in sorted(folder.glob("*.cdx.json"))]
    if not bills:
        print(f"no bill of materials in {folder}: run `nox -s build`", file=sys.stderr)
        return 1
    components = [component for bill in bills for component in bill["components"]]
    rules = Rules.read()
    found = [
        *(f"{line}; see release/licences.toml" for line in sorted(wrong(components, rules))),
        *(f"{name} has no LICENSE; write license-files in its pyproject.toml" for name in without_text(folder)),
    ]
    for name in sorted(rules.inside.keys() & {full_name(component) for component in components}):
        print(f"note: {name}: {rules.inside[name]}.")
    print(*found, sep="\n", end="\n" if found else "", file=sys.stderr)
    print(f"licences of {len(components)} packages: {f'{len(found)} wrong' if found else 'all allowed or excepted'}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
