"""Hands over what a body yielded; what its class does not declare is told with the line of the ``yield``."""

from __future__ import annotations

from collections.abc import Callable
from types import FrameType
from typing import Any, TypeVar

from mosaic_core.contract.declared.declared_message import WrongMessage

R = TypeVar("R")


def hand_over(stream: object, item: Any, consume: Callable[[Any], R]) -> R:
    """``consume(item)``, which the generator ``stream`` has just yielded."""
    try:
        return consume(item)
    except WrongMessage as wrong:
        raise wrong.told_at(_line_of(stream)) from None


def _line_of(stream: object) -> str:
    """Where a generator, or the one that it yields from, stands; empty for anything else that is iterated."""
    frame: FrameType | None = None
    while stream is not None:
        frame = getattr(stream, "gi_frame", None) or getattr(stream, "ag_frame", None) or frame
        stream = getattr(stream, "gi_yieldfrom", None)
    return f"{frame.f_code.co_filename}:{frame.f_lineno}" if frame is not None else ""
