"""NPY and NPZ: read by their headers, so that one that lies about its size costs no memory; never pickled objects."""

from __future__ import annotations

import ast
import io
import math
import zipfile
import zlib
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.file_bytes import MAX_FILE_BYTES, CloudFileError

_POINTS = ("points", "xyz", "cloud", "pcd", "arr_0")
_COLOURS = ("rgb", "colors", "colours")
_INTENSITIES = ("intensity", "intensities")
_MAX_HEADER_BYTES = 64 * 1024


def npy_array(data: bytes) -> NDArray[Any]:
    """The array of one NPY file. Raises :class:`CloudFileError`."""
    kind, is_fortran, shape, start = _header(data)
    if kind.hasobject:
        raise CloudFileError("it holds Python objects, not numbers")
    count = math.prod(shape)
    if start + count * kind.itemsize > len(data):
        raise CloudFileError(f"it ends after {len(data) - start} of {count * kind.itemsize} bytes")
    flat = np.frombuffer(data, dtype=kind, count=count, offset=start)
    return flat.reshape(shape, order="F" if is_fortran else "C")


def _header(data: bytes) -> tuple[np.dtype[Any], bool, tuple[int, ...], int]:
    """Type, order, shape, and where the values begin. Read here, because numpy's own reader also takes headers that
    Python 2 wrote, and raises whatever its tokenizer raises."""
    if data[:6] != npy.MAGIC_PREFIX or len(data) < 12:
        raise CloudFileError("its header can't be read: it doesn't begin as NPY does")
    size_bytes = 2 if data[6] == 1 else 4
    start = 8 + size_bytes + int.from_bytes(data[8 : 8 + size_bytes], "little")
    try:
        if start > _MAX_HEADER_BYTES:
            raise ValueError(f"{start} bytes long")
        header = ast.literal_eval(data[8 + size_bytes : start].decode())
        kind, shape = npy.descr_to_dtype(header["descr"]), header["shape"]
        if kind.itemsize == 0 or not all(isinstance(edge, int) and edge >= 0 for edge in shape):
            raise ValueError(f"{kind} of shape {shape}")
        return kind, bool(header["fortran_order"]), tuple(shape), start
    except (ValueError, TypeError, SyntaxError, KeyError, MemoryError, RecursionError) as error:
        raise CloudFileError(f"its header can't be read: {error}") from None


def npz_cloud(data: bytes) -> PointCloud:
    """``points`` (or ``xyz``, or the only array), with ``intensity`` and ``rgb`` (or ``colors``) if they are there."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            arrays = {info.filename.removesuffix(".npy"): _member(archive, info) for info in archive.infolist()}
    except (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, EOFError, zlib.error) as error:
        raise CloudFileError(f"it is no archive that can be read: {error}") from None
    found = next((name for name in _POINTS if name in arrays), next(iter(arrays)) if len(arrays) == 1 else None)
    if found is None:
        raise CloudFileError(f"none of its arrays is called points or xyz; it has {', '.join(arrays) or 'none'}")
    return cloud_of(
        arrays[found],
        intensity=next((arrays[name] for name in _INTENSITIES if name in arrays), None),
        rgb=next((arrays[name] for name in _COLOURS if name in arrays), None),
    )


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> NDArray[Any]:
    if info.file_size > MAX_FILE_BYTES:
        raise CloudFileError(f"its array {info.filename!r} unpacks to {info.file_size} bytes; too many")
    with archive.open(info) as member:
        return npy_array(member.read(MAX_FILE_BYTES))
