"""Writes what a release consists of, as CycloneDX: `mosaic-python.cdx.json` and `mosaic-dashboard.cdx.json`.

``python -m release.bill_of_materials dist``. The wheels of that folder are installed with all that `locks/runtime.txt`
names into an empty environment, and that is what is described; the dashboard's is what page and packages contain.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Any

from release.requirements import LOCKS, ROOT

DASHBOARD = ROOT / "dashboard"
PYTHON_BILL = "mosaic-python.cdx.json"
DASHBOARD_BILL = "mosaic-dashboard.cdx.json"
FOLDER = re.compile(r"file://[^\"]*/(?=[^/\"]+\")")
"""Where a wheel lay on the machine that built it."""


def write_python(folder: Path) -> None:
    """Of the machine that builds: markers of the lock that are for others leave nothing here."""
    with tempfile.TemporaryDirectory() as place:
        venv.create(place, with_pip=False)
        pip = [sys.executable, "-m", "pip", "--python", place, "--disable-pip-version-check", "install", "--quiet"]
        _must([*pip, "--require-hashes", "--requirement", str(LOCKS / "runtime.txt")])
        _must([*pip, "--no-deps", *(str(wheel) for wheel in sorted(folder.glob("*.whl")))])
        words = [sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible", "--spec-version", "1.6"]
        project = ["--pyproject", str(ROOT / "pyproject.toml"), "--mc-type", "application"]
        _must([*words, *project, "--output-file", str(folder / PYTHON_BILL), str(Path(place, "bin", "python"))])
    bill = (folder / PYTHON_BILL).read_text()
    (folder / PYTHON_BILL).write_text(FOLDER.sub("", bill))


def write_dashboard(folder: Path) -> None:
    """What is for development alone is left out here: npm's own `--omit=dev` loses what both need, React for one."""
    words = ["npm", "sbom", "--package-lock-only", "--sbom-format", "cyclonedx"]
    done = subprocess.run(words, cwd=DASHBOARD, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"npm sbom failed:\n{done.stderr}")
    lock = json.loads((DASHBOARD / "package-lock.json").read_text())["packages"]
    bill = shipped(json.loads(done.stdout), lock)
    # The same sources make the same file: neither the time nor a random number is part of it.
    bill.pop("serialNumber", None)
    bill["metadata"].pop("timestamp", None)
    (folder / DASHBOARD_BILL).write_text(json.dumps(bill, indent=2) + "\n")


def shipped(bill: dict[str, Any], lock: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """``bill`` without the packages that ``lock``, `packages` of a `package-lock.json`, has for development alone."""
    names = {
        f"{entry.get('name') or path.rpartition('node_modules/')[2]}@{entry['version']}"
        for path, entry in lock.items()
        if "version" in entry and not ({"dev", "devOptional"} & entry.keys())
    }
    components = [one for one in bill["components"] if one["bom-ref"] in names]
    known = {one["bom-ref"] for one in (*components, bill["metadata"]["component"])}
    dependencies = [
        {**one, "dependsOn": [ref for ref in one.get("dependsOn", []) if ref in known]}
        for one in bill["dependencies"]
        if one["ref"] in known
    ]
    return {**bill, "components": components, "dependencies": dependencies}


def main(folder: Path) -> int:
    write_dashboard(folder)
    write_python(folder)
    for name in (PYTHON_BILL, DASHBOARD_BILL):
        print(f"{name}: {len(json.loads((folder / name).read_text())['components'])} components")
    return 0


def _must(words: list[str]) -> None:
    done = subprocess.run(
        words, cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ, "NO_COLOR": "1"}
    )
    if done.returncode != 0:
        sys.exit(f"This failed: {' '.join(words)}\n{done.stderr or done.stdout}")


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
