"""Finds what a body sends, and tells one that sends nothing, or something at once that belongs one after the other."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterable, Callable, Iterable, Mapping, Sized
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.declared.wrong_declaration import wrong_message

_ONE = (BaseModel, Mapping, str, bytes, bytearray, memoryview)
"""A message: what would be sent of it are its parts."""


def items_of(body: Callable[[], Any]) -> Iterable[Any]:
    """What a ``def`` body sends. Raises :class:`MosaicError` (``plugin.wrong_message``) if it is nothing to iterate, a
    message alone, or of a camera or microphone anything that is there as a whole: the parts of a picture are none."""
    stream: Any = body()
    if isinstance(stream, Iterable) and not isinstance(stream, _ONE) and not (_is_track(body) and _is_whole(stream)):
        return stream
    if inspect.iscoroutine(stream):
        stream.close()  # else Python warns of it as well
    whose, (text, cure) = f"{getattr(body, '__qualname__', 'the body')}()", _verdict(stream, body)
    raise wrong_message(whose, code_of(body), f"returned {kind_of(stream)}, {text} {cure}", cure)


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
