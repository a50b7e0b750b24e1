"""Prints what CHANGELOG.md says of a version: ``python -m release.notes v1.2.3``.

Fails where the tag, the distributions and the changelog are not of one mind, before anything is published.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from release.requirements import PROJECTS, ROOT, read

CHANGES = ROOT / "changes"


def of(version: str, changelog: str) -> str:
    """The section under `## version (date)`, without its heading; empty where there is none."""
    found = re.search(rf"^## {re.escape(version)} \(.*?\)\n(.*?)(?=^## |\Z)", changelog, re.MULTILINE | re.DOTALL)
    return found[1].strip() if found else ""


def wrong(tag: str, versions: dict[str, str], changelog: str, left: list[str]) -> Iterator[str]:
    """One sentence for each thing that must be mended before ``tag`` can be a release."""
    version = tag.removeprefix("v")
    for name, its in versions.items():
        if its != version:
            yield f"{name} is {its}, and the tag says {version}"
    if left:
        yield f"{len(left)} changes are not in CHANGELOG.md: nox -s changelog -- --write"
    elif not of(version, changelog):
        yield f"CHANGELOG.md has no section of {version}: nox -s changelog -- --write"


def main(tag: str) -> int:
    versions = {(table := read(project)["project"])["name"]: table["version"] for project in PROJECTS}
    changelog = (ROOT / "CHANGELOG.md").read_text()
    found = list(wrong(tag, versions, changelog, [path.name for path in sorted(Path(CHANGES).glob("+*.md"))]))
    for line in found:
        print(line, file=sys.stderr)
    if not found:
        print(of(tag.removeprefix("v"), changelog))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
