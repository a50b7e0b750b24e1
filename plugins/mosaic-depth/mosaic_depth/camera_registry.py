"""Finds depth cameras through the entry-point group ``mosaic.depth_cameras``: loaded when a file names one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeAlias

from mosaic_core.words.errors import hint_at
from mosaic_depth.depth_camera import DepthCamera

GROUP = "mosaic.depth_cameras"

Opener: TypeAlias = Callable[[Any], DepthCamera]
"""Opens a camera as :class:`~mosaic_depth.DepthCameraParams` describe it: mostly its class."""


def opener_of(kind: str, installed: Iterable[EntryPoint] | None = None) -> Opener:
    """What opens cameras of this kind. Raises :class:`ValueError`: unknown, claimed twice, or broken."""
    found = entry_points(group=GROUP) if installed is None else installed
    entries = {(entry.name, entry.value): entry for entry in found}
    claims = [entry for entry in entries.values() if entry.name == kind]
    if not claims:
        names = sorted({entry.name for entry in entries.values()})
        raise ValueError(f"no depth camera {kind!r}{hint_at(kind, names)} Installed: {', '.join(names)}")
    if len(claims) > 1:
        both = " and ".join(sorted(entry.value for entry in claims))
        raise ValueError(f"depth camera {kind!r} is claimed by {both}; uninstall one of them")
    return _loaded(claims[0])


def _loaded(entry: EntryPoint) -> Opener:
    try:
        opener: Opener = entry.load()
    except Exception as error:
        cause = f"{type(error).__name__}: {error}"
        raise ValueError(f"depth camera {entry.name!r} can't be loaded from {entry.value}: {cause}") from error
    if not callable(opener):
        raise ValueError(f"depth camera {entry.name!r}: {entry.value} can't be called with the params")
    return opener
