"""Hands over what a body yields, and knows the line of the author's code that sends something."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterable, Callable, Iterable, Mapping, Sized
from contextvars import ContextVar
from types import FrameType
from typing import Any, TypeVar

from pydantic import BaseModel

from mosaic_core.words.errors import MosaicError

R = TypeVar("R")
_ONE = (BaseModel, Mapping, str, bytes, bytearray, memoryview)
"""A message: what would be sent of it are its parts."""
_BETWEEN = ("mosaic_core.contract.", "typing")
"""Modules between an author's code and what asks whose it is; ``typing`` makes instances of ``Base[T]``."""
_yielding: ContextVar[object] = ContextVar("_yielding", default=None)
"""The generator whose item is being handed over on this thread, or by this task."""


def items_of(body: Callable[[], Any]) -> Iterable[Any]:
    """What a ``def`` body sends. Raises :class:`MosaicError` (``plugin.wrong_message``) if it is nothing to iterate, a
    message alone, or of a camera or microphone anything that is there as a whole: the parts of a picture are none."""
    stream: Any = body()
    if isinstance(stream, Iterable) and not isinstance(stream, _ONE) and not (_is_track(body) and _is_whole(stream)):
        return stream
    if inspect.iscoroutine(stream):
        stream.close()  # else Python warns of it as well
    code = getattr(body, "__code__", None)
    place = f" ({code.co_filename}:{code.co_firstlineno})" if code is not None else ""
    what = f"{getattr(body, '__qualname__', 'the body')}(){place} returned {kind_of(stream)}"
    text, cure = _verdict(stream, body)
    raise MosaicError(f"{what}, {text} {cure}", code="plugin.wrong_message", cure=cure)


def _is_track(body: Callable[[], Any]) -> bool:
    return getattr(body, "__name__", "") in ("frames", "sounds")


def _is_whole(stream: Any) -> bool:
    """Whether it is there already, as a picture or a list is; ``()`` is what a body that nobody wrote returns."""
    return isinstance(stream, Sized) and not (isinstance(stream, tuple) and not stream)


def _verdict(stream: Any, body: Callable[[], Any]) -> tuple[str, str]:
    """What is wrong with it, and the cure."""
    if isinstance(stream, AsyncIterable):
        return "which only `async for` iterates.", "Write `async def`, and `yield` what it gives."
    if _is_track(body) and stream is not None:
        return "and no stream.", "Let it yield one after the other: `yield` instead of `return`."
    if isinstance(stream, _ONE):
        return "which is one message.", "Return it by `yield` instead of `return`."
    return "and nothing to send.", "Let it yield."


def kind_of(value: object) -> str:
    """The type of a value; of an array also the type of its numbers and its shape."""
    shape, numbers = getattr(value, "shape", None), getattr(value, "dtype", None)
    name = type(value).__name__
    return f"{name} {numbers} {shape}" if isinstance(shape, tuple) and shape and numbers is not None else name


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
    while frame is not None and frame.f_globals.get("__name__", "").startswith(_BETWEEN):
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
