"""Checks the two files of an occupancy map: a PGM picture, and the YAML text that says where it lies. Pure."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import dataclass, field
from typing import Any

import yaml

MAX_PGM_BYTES = 16 * 1024 * 1024
"""4000 × 4000 cells: 200 m × 200 m at 5 cm."""
MAX_YAML_BYTES = 64 * 1024
_SPACE = rb"(?:\s|#[^\n]*\n)+"
_PGM = re.compile(rb"P(?P<kind>[25])" + _SPACE + rb"(\d{1,6})" + _SPACE + rb"(\d{1,6})" + _SPACE + rb"(\d{1,5})\s")
"""The header of a PGM picture: kind, width, height, largest value (netpbm's pgm(5))."""
_MAX_NAME = 100


class BadMapFile(ValueError):
    """The file is no map; the message says why."""


@dataclass(frozen=True, slots=True)
class MapFile:
    """One file with a name that is safe to show and to write."""

    name: str
    content: bytes = field(repr=False)


def pgm_file(name: str | None, content: bytes) -> MapFile:
    """A checked picture; raises :class:`BadMapFile`."""
    if len(content) > MAX_PGM_BYTES:
        raise BadMapFile(f"pgm_file is larger than {MAX_PGM_BYTES} bytes")
    header = _PGM.match(content[:4096])
    if header is None:
        raise BadMapFile("pgm_file is no PGM picture: it begins with P5 (or P2), width, height and the largest value")
    width, height, most = (int(number) for number in header.groups()[1:])
    cell_bytes = 1 if most < 256 or header["kind"] == b"2" else 2
    if not (width and height and 0 < most < 65536) or len(content) - header.end() < width * height * cell_bytes:
        raise BadMapFile(f"pgm_file is too short for {width} x {height} cells")
    return MapFile(_harmless(name, "map.pgm"), content)


def yaml_file(name: str | None, content: bytes) -> MapFile:
    """A checked description; raises :class:`BadMapFile`."""
    if len(content) > MAX_YAML_BYTES:
        raise BadMapFile(f"yaml_file is larger than {MAX_YAML_BYTES} bytes")
    try:
        described = yaml.safe_load(content)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise BadMapFile("yaml_file is no YAML") from error
    if not isinstance(described, dict) or not _says_where(described):
        raise BadMapFile("yaml_file needs a resolution (metres per cell) and an origin ([x, y, yaw])")
    return MapFile(_harmless(name, "map.yaml"), content)


def zipped(files: tuple[MapFile, ...]) -> bytes:
    """All files in one archive."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as into:
        for number, file in enumerate(files):
            is_taken = any(file.name == other.name for other in files[:number])
            into.writestr(f"{number}-{file.name}" if is_taken else file.name, file.content)
    return archive.getvalue()


def _says_where(described: dict[Any, Any]) -> bool:
    resolution, origin = described.get("resolution"), described.get("origin")
    return _is_number(resolution) and isinstance(origin, list) and len(origin) >= 2 and all(map(_is_number, origin))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _harmless(name: str | None, otherwise: str) -> str:
    """The last part of a path, of plain characters: no machine's folders are shown, none can be written to."""
    last = re.split(r"[/\\]", name or "")[-1]
    return re.sub(r"[^A-Za-z0-9._-]", "_", last).lstrip(".")[-_MAX_NAME:] or otherwise
