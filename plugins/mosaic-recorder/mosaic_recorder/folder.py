"""The folder of one recorder: names of files, what is kept, and what goes first when there is too much.

Only files whose names were made here are listed or deleted, and never one that is being written.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import shutil
import stat
import threading
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO

_log = logging.getLogger(__name__)

MAX_NAME_CHARACTERS = 64
_OURS = re.compile(
    r"(?P<name>[\w.-]+)_(?P<at>\d{8}_\d{6})_(?P<label>[\w.-]+?)(~\d+)?\.(?P<suffix>mp4|mkv|mcap|png)", re.ASCII
)
_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_SHARED = stat.S_ISVTX | stat.S_ISGID
"""Somebody meant the folder for several, as ``/tmp``."""
_UNSAFE = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file of the recorder's folder. ``modified_at_ns`` is the wall clock's, which only orders them."""

    name: str
    label: str
    size_bytes: int
    modified_at_ns: int


def safe_name(text: str, default: str) -> str:
    """``text`` as part of a file name: letters, digits, ``-`` and ``_``; never a path, never empty or hidden."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return _UNSAFE.sub("-", plain).strip("-_")[:MAX_NAME_CHARACTERS].strip("-_") or default


def new_file(path: Path, buffering: int = -1) -> IO[bytes]:
    """A file that only its owner reads: what a camera saw concerns nobody else. Raises :class:`FileExistsError`."""
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    return os.fdopen(os.open(path, flags, 0o600), "r+b", buffering)


def made_for_its_owner(folder: Path) -> None:
    """``folder`` is there; what was missing of it, and of those above it, is for its owner alone."""
    if not folder.parent.exists():
        made_for_its_owner(folder.parent)
    folder.mkdir(0o700, exist_ok=True)


def closed_to_others(folder: Path) -> bool:
    """Whether only its owner can enter ``folder``: it is closed to others if it is this account's, was not made for
    several, and holds nothing but recordings. What else is kept there may be meant for others, and stays as it is."""
    found = folder.stat()
    if os.name == "nt" or not found.st_mode & _OTHERS:
        return True
    is_plain = not found.st_mode & _SHARED and not folder.is_mount() and folder.resolve() != _home()
    if found.st_uid != os.geteuid() or not is_plain or not all(_OURS.fullmatch(one.name) for one in folder.iterdir()):
        return False
    with contextlib.suppress(PermissionError):  # some file systems know no modes
        folder.chmod(stat.S_IMODE(found.st_mode) & ~_OTHERS)
    return not folder.stat().st_mode & _OTHERS


def _home() -> Path:
    return Path("~").expanduser().resolve()


def surplus(files: Iterable[StoredFile], max_files: int | None, max_bytes: int | None) -> list[StoredFile]:
    """The oldest files, as many as must go for the rest to be within both limits."""
    oldest_first = sorted(files, key=lambda file: (file.modified_at_ns, file.name))
    total_bytes = sum(file.size_bytes for file in oldest_first)
    gone: list[StoredFile] = []
    for file in oldest_first:
        too_many = max_files is not None and len(oldest_first) - len(gone) > max_files
        too_large = max_bytes is not None and total_bytes > max_bytes
        if not (too_many or too_large):
            break
        gone.append(file)
        total_bytes -= file.size_bytes
    return gone


class RecordingsFolder:
    """The folder of one recorder's files, for any thread. Methods that touch the disk raise :class:`OSError`."""

    def __init__(self, path: Path, max_files: int | None = None, max_bytes: int | None = None) -> None:
        self.path = path
        self._max_files = max_files
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._in_use: set[str] = set()
        self._is_told = False

    def claim(self, name: str, label: str, suffix: str, now: datetime | None = None) -> Path:
        """A name that no file has, in use until :meth:`release`. Makes the folder, if there is none, for its owner."""
        made_for_its_owner(self.path)
        self._close()
        at = f"{now or datetime.now():%Y%m%d_%H%M%S}"
        stem = f"{safe_name(name, 'recording')}_{at}_{safe_name(label, 'camera')}"
        with self._lock:
            number, path = 1, self.path / f"{stem}.{suffix}"
            while path.name in self._in_use or path.exists():
                number += 1
                path = self.path / f"{stem}~{number}.{suffix}"
            self._in_use.add(path.name)
        return path

    def _close(self) -> None:
        if closed_to_others(self.path) or self._is_told:
            return
        self._is_told = True
        mode = stat.S_IMODE(self.path.stat().st_mode)
        _log.warning(
            "others can look into %s (mode %04o), which is not this recorder's alone and stays so; the files in it are "
            "for their owner. Name a folder of its own in `directory`, or close this one: chmod 700",
            self.path,
            mode,
        )

    def release(self, path: Path) -> None:
        with self._lock:
            self._in_use.discard(path.name)

    def is_in_use(self, name: str) -> bool:
        with self._lock:
            return name in self._in_use

    def files(self) -> list[StoredFile]:
        """Newest first; also those that are being written."""
        if not self.path.is_dir():
            return []
        found = [self._stored(path) for path in self.path.iterdir()]
        return sorted((file for file in found if file is not None), key=lambda file: (-file.modified_at_ns, file.name))

    def delete(self, names: Sequence[str]) -> list[str]:
        """Delete files of this folder; the names of those that are not there, or in use, come back."""
        stored = {file.name for file in self.files()}
        refused = []
        for name in names:
            if name not in stored or self.is_in_use(name):
                refused.append(name)
            else:
                (self.path / name).unlink(missing_ok=True)
        return refused

    def tidy(self) -> list[str]:
        """Delete the oldest files beyond the limits of the folder; their names."""
        if self._max_files is None and self._max_bytes is None:
            return []
        files = self.files()
        busy = [file for file in files if self.is_in_use(file.name)]
        max_files = None if self._max_files is None else max(0, self._max_files - len(busy))
        busy_bytes = sum(file.size_bytes for file in busy)
        max_bytes = None if self._max_bytes is None else max(0, self._max_bytes - busy_bytes)
        gone = surplus((file for file in files if file not in busy), max_files, max_bytes)
        for file in gone:
            (self.path / file.name).unlink(missing_ok=True)
        return [file.name for file in gone]

    def free_bytes(self) -> int:
        """Of the disk that the folder is, or will be, on."""
        place = self.path
        while not place.exists() and place != place.parent:
            place = place.parent
        return shutil.disk_usage(place).free

    def _stored(self, path: Path) -> StoredFile | None:
        match = _OURS.fullmatch(path.name)
        if match is None or path.is_symlink() or not path.is_file():
            return None
        try:
            stat = path.stat()
        except FileNotFoundError:  # deleted by somebody else just now
            return None
        return StoredFile(path.name, match["label"], stat.st_size, stat.st_mtime_ns)
