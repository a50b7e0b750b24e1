"""Holds the sizes of a release against `budgets.json`: ``python -m release.sizes dist``.

The page's first load is weighed where it is built, in `dashboard/packages/app/firstPage.ts`, against the same file.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

BUDGETS = Path(__file__).with_name("budgets.json")


def budget_of(file: str, budgets: dict[str, Any]) -> int | None:
    """In bytes; none for what has no budget, source distributions for one, which nobody waits for."""
    if file.endswith(".whl"):
        return int(budgets["wheels"].get(file.split("-")[0], budgets["any_other_wheel"]))
    if file.endswith(".tgz"):
        return int(budgets["packages"].get(file.rpartition("-")[0], budgets["any_other_package"]))
    return None


def too_large(files: dict[str, int], budgets: dict[str, Any]) -> Iterator[str]:
    for file, size in sorted(files.items()):
        budget = budget_of(file, budgets)
        if budget is not None and size > budget:
            yield f"{file} has {size / 1000:.0f} kB, its budget in release/budgets.json is {budget / 1000:.0f} kB"


def main(folder: Path) -> int:
    files = {path.name: path.stat().st_size for path in folder.iterdir() if path.is_file()}
    budgets = json.loads(BUDGETS.read_text())
    found = list(too_large(files, budgets))
    print(*found, sep="\n", end="\n" if found else "", file=sys.stderr)
    weighed = [size for file, size in files.items() if budget_of(file, budgets) is not None]
    verdict = f"{len(found)} too large" if found else "all in budget"
    print(f"sizes: {len(weighed)} files, {sum(weighed) / 1000:.0f} kB, {verdict}")
    return int(bool(found) or not weighed)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
