"""Finds the line of an author's code: of a class or function, and of whoever has called the contract."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextvars import ContextVar
from types import CodeType, FrameType
from typing import Any, TypeVar

from mosaic_core.words.errors import NOWHERE, CodeLine

R = TypeVar("R")
_BETWEEN = ("mosaic_core.contract.", "abc", "typing", "pydantic.")
"""Modules whose code runs while a class is made, or something of the contract is called; ``typing`` makes instances of
``Base[T]``."""
_yielding: ContextVar[object] = ContextVar("_yielding", default=None)
"""The generator whose item is being handed over on this thread, or by this task."""


def code_of(thing: Any) -> CodeLine:
    """Where a class or function stands."""
    try:
        code = getattr(inspect.unwrap(thing), "__code__", None)
        if isinstance(code, CodeType):
            return CodeLine(code.co_filename, code.co_firstlineno)
        return CodeLine(str(inspect.getsourcefile(thing)), inspect.getsourcelines(thing)[1])
    except (OSError, TypeError, ValueError):
        return NOWHERE


def standing_at(thing: object) -> str:
    """`` (FILE:LINE)`` of a class or function; nothing where its source can't be found."""
    return code_of(thing).in_brackets


def author_frame() -> FrameType | None:
    """The innermost frame that is not the contract's."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith(_BETWEEN):
        frame = frame.f_back
    return frame


def line_of(frame: FrameType | None) -> CodeLine:
    """Where it is now."""
    return NOWHERE if frame is None else CodeLine(frame.f_code.co_filename, frame.f_lineno)


def line_in(frame: FrameType | None) -> str:
    """``FILE:LINE in NAME`` where it is now; empty where there is none."""
    return "" if frame is None else f"{line_of(frame)} in {frame.f_code.co_qualname}"


def caller() -> CodeLine:
    """The line that called the contract: where that is the framework's own, of the ``yield`` whose item it hands
    over."""
    frame = author_frame()
    if frame is None or frame.f_globals.get("__name__", "").startswith("mosaic_core."):
        return line_of(_innermost(_yielding.get()))
    return line_of(frame)


def _innermost(stream: object) -> FrameType | None:
    """The frame of a generator, or of the one that it yields from; ``None`` of anything else that is iterated."""
    frame: FrameType | None = None
    while stream is not None:
        frame = getattr(stream, "gi_frame", None) or getattr(stream, "ag_frame", None) or frame
        stream = getattr(stream, "gi_yieldfrom", None)
    return frame


def hand_over(stream: object, item: Any, consume: Callable[[Any], R]) -> R:
    """``consume(item)``, which the generator ``stream`` has just yielded."""
    token = _yielding.set(stream)
    try:
        return consume(item)
    finally:
        _yielding.reset(token)
