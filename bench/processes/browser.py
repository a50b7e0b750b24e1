"""The Chromium of this machine."""

from __future__ import annotations

import os
import shutil

CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def chromium() -> str | None:
    """Where it is; ``MOSAIC_CHROMIUM`` names another one."""
    return os.environ.get("MOSAIC_CHROMIUM") or next(filter(None, map(shutil.which, CHROMIUMS)), None)
