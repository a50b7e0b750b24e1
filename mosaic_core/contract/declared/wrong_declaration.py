"""Makes the error for what the author of a class declares: it names the class, its file and line, and the cure."""

from __future__ import annotations

import inspect

from mosaic_core.words.errors import MosaicError

_MAKERS = ("mosaic_core.contract.", "abc", "pydantic.")
"""Modules whose code runs while a class is made."""


def wrong_declaration(cls: type, message: str, cure: str) -> MosaicError:
    """The error for a class that is being made, or for what an instance of it says."""
    return MosaicError(f"{_place_of(cls)}{cls.__qualname__}: {message} {cure}", code="config.broken_plugin", cure=cure)


def _place_of(cls: type) -> str:
    """``file:line: `` of the class statement that is being executed, else of the class; empty if nobody knows it."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith(_MAKERS):
        frame = frame.f_back
    if frame is not None and frame.f_globals.get("__name__") == cls.__module__:
        return f"{frame.f_code.co_filename}:{frame.f_lineno}: "
    try:
        return f"{inspect.getsourcefile(cls)}:{inspect.getsourcelines(cls)[1]}: "
    except (OSError, TypeError):
        return ""
