"""The site of the documentation, built once for all who look at it."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SITE = ROOT / "site"
LAST = SITE / "sitemap.xml"
"""Written when the pages are there."""
MADE_OF = ("docs", "docs_theme", "mosaic_core", "zensical.toml")
"""Pages, their frame, and the modules whose words the reference shows."""


def built_site() -> Path:
    """Of the pages as they are now: what `nox -s docs` built, where nothing is newer. One process at a time looks."""
    folder = os.open(ROOT / "docs", os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        if _built_s() < max(path.stat().st_mtime for path in _sources()):
            _build()
    finally:
        os.close(folder)
    return SITE


def _build() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs" / "build_site.py"], capture_output=True, text=True)
    if done.returncode != 0:
        LAST.unlink(missing_ok=True)  # whoever looks next shall not take it for a site
    assert done.returncode == 0, done.stdout + done.stderr


def _built_s() -> float:
    """When it was built; 0 where it was not."""
    return LAST.stat().st_mtime if LAST.exists() else 0.0


def _sources() -> Iterator[Path]:
    for place in (ROOT / name for name in MADE_OF):
        yield from (path for path in (place, *place.rglob("*")) if path.is_file() and path.suffix != ".pyc")
