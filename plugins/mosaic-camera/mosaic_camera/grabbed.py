"""Declares what a source is asked for, and what it gives: one picture or packet, with its time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from mosaic_core.contract.media import Image

if TYPE_CHECKING:
    import av

Takes: TypeAlias = Callable[[float], bool]
"""Whether the picture of that time is wanted: ``captured_at_s`` of a live source, ``position_s`` of a recording. Asked
once for each picture, in their order."""


def takes_all(at_s: float) -> bool:
    return True


@dataclass(frozen=True, slots=True)
class WantedSource:
    """The size and rate that the configuration asks a source for; ``None``: whatever the source has."""

    source: int | str
    width: int | None = None
    height: int | None = None
    fps: float | None = None
    passes_packets: bool = False
    """H.264 that the source has already, or that a camera makes itself, may come as packets."""


@dataclass(frozen=True, slots=True)
class Grabbed:
    """A picture that a source gave, or a packet that holds one. ``captured_at_s``: monotonic clock; ``position_s``:
    place in the recording, 0 for live sources; ``is_key``: it needs no other picture; ``image`` is ``None`` where it
    was not taken, and so not decoded, or where it is garbage (``is_garbled``)."""

    image: Image | av.Packet[Any] | None
    captured_at_s: float
    position_s: float = 0.0
    is_key: bool = True
    is_garbled: bool = False


def capture_time_s(stamp_s: float, now_s: float) -> float:
    """A V4L2 driver stamps with the monotonic clock; anything that isn't just now is something else."""
    return stamp_s if 0.0 <= now_s - stamp_s < 1.0 else now_s
