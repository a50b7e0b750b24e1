"""Hands over what a body yields, and knows the line of the author's code that sends something."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from contextvars import ContextVar
from types import FrameType
from typing import Any, TypeVar

from pydantic import BaseModel

from mosaic_core.words.errors import MosaicError

R = TypeVar("R")
_ONE = (BaseModel, Mapping, str, bytes, bytearray, memoryview)
"""A message: what would be sent of it are its parts."""
_yielding: ContextVar[object] = ContextVar("_yielding", default=None)
"""The generator whose item is being handed over on this thread, or by this task."""


def items_of(body: Callable[[], Any]) -> Iterable[Any]:
    """What a ``def`` body sends. Raises :class:`MosaicError` (``plugin.wrong_message``) if it is nothing to iterate, or
    a message alone."""
    stream: Any = body()
    if isinstance(stream, Iterable) and not isinstance(stream, _ONE):
        return stream
    code = getattr(body, "__code__", None)
    place = f" ({code.co_filename}:{code.co_firstlineno})" if code is not None else ""
    what = f"{getattr(body, '__qualname__', 'the body')}(){place} returned {type(stream).__name__}"
    text, cure = "and nothing to send.", "Let it yield."
    if isinstance(stream, _ONE):
        text, cure = "which is one message.", "Return it by `yield` instead of `return`."
    raise MosaicError(f"{what}, {text} {cure}", code="plugin.wrong_message", cure=cure)


def hand_over(stream: object, item: Any, consume: Callable[[Any], R]) -> R:
    """``consume(item)``, which the generator ``stream`` has just yielded."""
    token = _yielding.set(stream)
    try:
        return consume(item)
    finally:
        _yielding.reset(token)


def caller() -> str:
    """``file:line`` of the code that called the contract: where that is the framework's own, of the ``yield`` whose
    item it hands over; empty where there is none."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith("mosaic_core.contract."):
        frame = frame.f_back
    if frame is None or frame.f_globals.get("__name__", "").startswith("mosaic_core."):
        return _line_of(_yielding.get())
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"


def _line_of(stream: object) -> str:
    """Where a generator, or the one that it yields from, stands; empty for anything else that is iterated."""
    frame: FrameType | None = None
    while stream is not None:
        frame = getattr(stream, "gi_frame", None) or getattr(stream, "ag_frame", None) or frame
        stream = getattr(stream, "gi_yieldfrom", None)
    return f"{frame.f_code.co_filename}:{frame.f_lineno}" if frame is not None else ""
