"""Reads the import map of the dashboard's page, which the Content-Security-Policy has to allow by its hash.

It tells widgets of plugins where this page's own React is; browsers take it from inside the page alone.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path

_MAP = re.compile(rb'<script type="importmap">(.*?)</script>', re.DOTALL)


def import_map_sources(dashboard_dir: Path) -> str:
    """The sources for ``script-src``, `` 'sha256-…'`` for each map of ``index.html``; empty without one."""
    try:
        page = (dashboard_dir / "index.html").read_bytes()
    except OSError:
        return ""
    hashes = (base64.b64encode(hashlib.sha256(text).digest()).decode() for text in _MAP.findall(page))
    return "".join(f" 'sha256-{one}'" for one in hashes)
