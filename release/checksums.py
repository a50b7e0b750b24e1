"""Writes how a release is checked and installed: `SHA256SUMS`, and `mosaic-requirements.txt` with a hash of everything.

``python -m release.checksums dist``. With that second file `pip install --require-hashes` gets exactly what was built
and tested here, the packages of others too, whatever a registry offers by then.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

from release.requirements import LOCKS, PROJECTS, normal, read

SUMS = "SHA256SUMS"
REQUIREMENTS = "mosaic-requirements.txt"
HEAD = """\
# Everything that MOSAIC's distributions of one release need, with all extras, and these themselves:
#   pip install --require-hashes -r mosaic-requirements.txt
# Take out the distributions of MOSAIC that you don't want, and whatever else you know you don't need.
"""


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def requirements(folder: Path) -> str:
    """The locked set, then ours in the versions of ``folder``, as wheels."""
    lines = [HEAD + _without_header((LOCKS / "runtime.txt").read_text())]
    for project in PROJECTS:
        table = read(project)["project"]
        name = normal(table["name"]).replace("-", "_")
        files = sorted(folder.glob(f"{name}-{table['version']}-*.whl"))
        if not files:
            raise SystemExit(f"no wheel of {table['name']} {table['version']} in {folder}")
        hashes = " \\\n".join(f"    --hash=sha256:{sha256(file)}" for file in files)
        lines.append(f"{normal(table['name'])}=={table['version']} \\\n{hashes}\n")
    return "".join(lines)


def _without_header(text: str) -> str:
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))


def main(folder: Path) -> int:
    (folder / REQUIREMENTS).write_text(requirements(folder))
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name != SUMS)
    (folder / SUMS).write_text("".join(f"{sha256(path)}  {path.name}\n" for path in files))
    print(f"{SUMS}: {len(files)} files")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
