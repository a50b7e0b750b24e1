"""Clouds from files: one file, or all of a folder or pattern as a sequence."""

from __future__ import annotations

import glob
import logging
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from mosaic_core import DeviceGone
from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.file_bytes import MAX_FILE_BYTES, CloudFileError
from mosaic_sensors.point_cloud.numpy_file import npy_array, npz_cloud
from mosaic_sensors.point_cloud.pcd_file import pcd_points
from mosaic_sensors.point_cloud.ply_file import ply_points

_log = logging.getLogger(__name__)

SAMPLE = Path(__file__).with_name("sample.ply")
_READERS: dict[str, Callable[[bytes], PointCloud]] = {
    ".ply": lambda data: cloud_of(ply_points(data)),
    ".pcd": lambda data: cloud_of(pcd_points(data)),
    ".npy": lambda data: cloud_of(npy_array(data)),
    ".npz": npz_cloud,
}


def read_cloud(path: Path) -> PointCloud:
    """The cloud in a PLY, PCD, NPY or NPZ file. Raises :class:`CloudFileError` that names the file and the cause,
    :class:`DeviceGone` if there is none, and :class:`OSError` if it can't be opened."""
    if not path.is_file():
        raise DeviceGone(f"{path}: there is no such file")
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise CloudFileError(f"{path}: '{path.suffix}' is none of {', '.join(_READERS)}")
    size_bytes = path.stat().st_size
    if size_bytes > MAX_FILE_BYTES:
        raise CloudFileError(f"{path}: {size_bytes} bytes; {MAX_FILE_BYTES} are the most")
    try:
        return reader(path.read_bytes())
    except ValueError as error:
        raise CloudFileError(f"{path}: {error}") from None


def cloud_paths(source: str) -> list[Path]:
    """The files that ``source`` means, ``scan_2`` before ``scan_10``: a file, a folder, or a pattern with ``*``.

    Raises :class:`DeviceGone` where there are none.
    """
    path = SAMPLE if source == "sample" else Path(source).expanduser()
    if path.is_dir():
        found = [one for one in path.iterdir() if one.suffix.lower() in _READERS and one.is_file()]
    elif glob.has_magic(source) and not path.exists():
        found = [Path(one) for one in glob.glob(str(path), recursive=True)]  # noqa: PTH207 - patterns may be absolute
    else:
        return [path]
    if not found:
        raise DeviceGone(f"{source}: no file with one of the endings {', '.join(_READERS)}")
    return sorted(found, key=_natural)


def _natural(path: Path) -> list[tuple[int, str]]:
    return [(int(digits or 0), text.lower()) for text, digits in re.findall(r"(\D*)(\d*)", str(path))]


class CloudFiles:
    """The clouds of a source, pass after pass; a file that can't be read is skipped if others can.

    The cloud of a single file is kept, so that showing it again costs no reading.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._kept: tuple[Path, PointCloud] | None = None
        self._complained: set[Path] = set()

    def one_pass(self) -> Iterator[PointCloud]:
        """Each file once. Raises :class:`CloudFileError` if none can be read."""
        paths = cloud_paths(self._source)
        if len(paths) == 1:
            yield self._only(paths[0])
            return
        last_error: Exception | None = None
        count = 0
        for path in paths:
            try:
                cloud = read_cloud(path)
            except (OSError, CloudFileError, DeviceGone) as error:
                last_error = error
                self._skip(path, error)
                continue
            count += 1
            yield cloud
        if last_error is not None and not count:
            raise last_error

    def _only(self, path: Path) -> PointCloud:
        if self._kept is None or self._kept[0] != path:
            self._kept = path, read_cloud(path)
        return self._kept[1]

    def _skip(self, path: Path, error: Exception) -> None:
        if path not in self._complained:
            self._complained.add(path)
            _log.warning("left out: %s", error)
