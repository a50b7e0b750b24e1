"""Opens a page in the desktop's browser, and only there: never a text browser inside the terminal."""

from __future__ import annotations

import os
import sys
import webbrowser


def has_desktop() -> bool:
    """Whether this process can show a window."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def opened(page: str) -> bool:
    """Open ``page``; ``False`` if there is no desktop or no browser."""
    if not has_desktop():
        return False
    try:
        return webbrowser.open(page)
    except webbrowser.Error:
        return False
