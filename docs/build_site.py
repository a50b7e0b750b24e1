"""Builds the site of these pages into `site/`; warnings are errors.

Puts the script that draws diagrams into it first: the theme would load it from a server of others, and a site that is
read on a robot's network has no internet.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
MERMAID = ROOT / "dashboard/node_modules/@mermaid-js/tiny/dist/mermaid.tiny.js"
COPIES = {
    MERMAID: ROOT / "docs_theme/assets/javascripts/mermaid.js",
    ROOT / "dashboard/packages/app/public/favicon.svg": ROOT / "docs_theme/assets/images/logo.svg",
}
"""The diagrams' script and the dashboard's own mark."""


def main() -> int:
    """Build; returns the exit code."""
    if not MERMAID.exists():
        print(f"{MERMAID} is missing: run `npm ci` in dashboard/, it draws the diagrams of the site", file=sys.stderr)
        return 1
    for source, place in COPIES.items():
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, place)
    words = [sys.executable, "-m", "zensical", "build", "--clean", "--strict"]
    return subprocess.run(words, cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
