"""Notices that files have changed: by their times, of which the file system is asked, and then by what they say.

A robot's own code is some dozens of files: to ask for all of them takes less than a millisecond, works on every system
and on network folders, and needs no library.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class _SeenFile:
    stamp: tuple[int, int]
    checksum: int


class SourceWatch:
    """Remembers how files were. ``files``: those to look at now; asked each time, so that new ones are seen."""

    def __init__(self, files: Callable[[], Iterable[Path]]) -> None:
        self._files = files
        self._seen: Mapping[Path, _SeenFile] = {}
        self._seen = self._now()

    def changed(self) -> frozenset[Path]:
        """What says something else than at the last call, or is new, or gone; not what was only written again. Blocks
        briefly."""
        before, self._seen = self._seen, self._now()
        both = before.keys() | self._seen.keys()
        return frozenset(path for path in both if _checksum(before, path) != _checksum(self._seen, path))

    def learn(self) -> None:
        """There may be more files to look at than before; as they are now, they are known."""
        self._seen = {**self._now(), **self._seen}

    def _now(self) -> Mapping[Path, _SeenFile]:
        found: dict[Path, _SeenFile] = {}
        for path in self._files():
            try:
                found[path] = self._as_it_is(path)
            except OSError:
                continue  # gone, or being written anew
        return found

    def _as_it_is(self, path: Path) -> _SeenFile:
        status, seen = path.stat(), self._seen.get(path)
        stamp = status.st_mtime_ns, status.st_size
        if seen is not None and seen.stamp == stamp:
            return seen
        return _SeenFile(stamp, zlib.crc32(path.read_bytes()))


def _checksum(files: Mapping[Path, _SeenFile], path: Path) -> int | None:
    found = files.get(path)
    return None if found is None else found.checksum
