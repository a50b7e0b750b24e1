"""Installs every wheel of a folder alone into an empty environment and uses it there: what it declares is all it needs.

``python tests/distributions/install_alone.py dist``. Other packages come from the index that pip is set to.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

SIDE_BY_SIDE = 2
USE = """
import importlib, pkgutil, subprocess, sys
from importlib.metadata import distribution, files

name = sys.argv[1]
packages = {path.parts[0] for path in files(name) if path.name == "__init__.py" and len(path.parts) == 2}
assert packages, f"{name} brings no package"
for package in sorted(packages):
    for module in pkgutil.walk_packages([str(distribution(name).locate_file(package))], f"{package}."):
        if not any(part in module.name for part in ("__main__", "pytest_plugin", ".migrations.")):
            importlib.import_module(module.name)
for entry in distribution(name).entry_points:
    if entry.group != "pytest11":
        entry.load()
told = subprocess.run([sys.executable, "-m", "mosaic_core.cli.main", "connectors", "list", "--json"],
                      capture_output=True, text=True, check=True).stdout
wanted = [entry.name for entry in distribution(name).entry_points if entry.group == "mosaic.connectors"]
assert all(f\'"{one}"\' in told for one in wanted), told
for entry in distribution(name).entry_points:
    if entry.group == "mosaic.commands":
        words = [sys.executable, "-m", "mosaic_core.cli.main", entry.name, "--help"]
        subprocess.run(words, capture_output=True, check=True)
"""
"""Imports every module but those that others run (pytest, alembic), loads every entry point, lists the connector types
and asks every command for its help."""


def installed(wheel: Path) -> str:
    """What went wrong; empty: nothing."""
    name = wheel.name.split("-")[0].replace("_", "-")
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=False)
        pip = [sys.executable, "-m", "pip", "--python", folder, "--disable-pip-version-check", "install", "--quiet"]
        install = [*pip, "--no-compile", "--find-links", str(wheel.parent), str(wheel)]
        for words in (install, [str(Path(folder, "bin", "python")), "-c", USE, name]):
            done = subprocess.run(words, capture_output=True, text=True, cwd=folder, check=False)
            if done.returncode != 0:
                return f"{name}:\n{done.stderr or done.stdout}"
    return ""


def main(folder: Path) -> int:
    wheels = sorted(folder.resolve().glob("*.whl"))
    if not wheels:
        print(f"no wheels in {folder}: run `nox -s build`", file=sys.stderr)
        return 1
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        found = list(zip(wheels, pool.map(installed, wheels), strict=True))
    for wheel, wrong in found:
        print(f"{wheel.name}: {'fails' if wrong else 'installs and works alone'}")
    print(*(wrong for _, wrong in found if wrong), sep="\n", end="", file=sys.stderr)
    return int(any(wrong for _, wrong in found))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
