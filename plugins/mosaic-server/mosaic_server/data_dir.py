"""Finds the data directory of a server; cheap to import, for programs that only look there."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import platformdirs

FILE_NAME = "mosaic-server.sqlite3"


def default_data_dir() -> Path:
    """``MOSAIC_DATA_DIR`` or the platform's directory for user data."""
    named = os.environ.get("MOSAIC_DATA_DIR")
    return Path(named) if named else Path(platformdirs.user_data_dir("mosaic", appauthor=False))


def lock_file(database: Path) -> Path:
    """Who holds a lock on it serves the SQLite file beside it."""
    return database.with_suffix(".lock")


def is_served(data_dir: Path) -> bool:
    """Whether a server runs on the SQLite file of that directory now."""
    path = lock_file(data_dir / FILE_NAME)
    if not path.exists():
        return False
    descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return False
