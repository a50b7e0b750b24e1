"""Notices that files have changed, by asking the file system for their times.

A robot's own code is some dozens of files: to ask for all of them takes less than a millisecond, works on every system
and on network folders, and needs no library.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeAlias

Stamp: TypeAlias = tuple[int, int]


class SourceWatch:
    """Remembers how files were. ``files``: those to look at now; asked each time, so that new ones are seen."""

    def __init__(self, files: Callable[[], Iterable[Path]]) -> None:
        self._files = files
        self._stamps = self._now()

    def changed(self) -> frozenset[Path]:
        """What is another file than at the last call, or new, or gone. Blocks briefly."""
        before, self._stamps = self._stamps, self._now()
        both = before.keys() | self._stamps.keys()
        return frozenset(path for path in both if before.get(path) != self._stamps.get(path))

    def learn(self) -> None:
        """There may be more files to look at than before; as they are now, they are known."""
        self._stamps = {**self._now(), **self._stamps}

    def _now(self) -> dict[Path, Stamp]:
        found: dict[Path, Stamp] = {}
        for path in self._files():
            try:
                status = path.stat()
            except OSError:
                continue  # gone, or being written anew
            found[path] = (status.st_mtime_ns, status.st_size)
        return found
