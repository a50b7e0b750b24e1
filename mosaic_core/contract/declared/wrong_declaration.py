"""Makes the error for what the author of a class declares: it names the class, its file and line, and the cure."""

from __future__ import annotations

import inspect

from mosaic_core.words.errors import NOWHERE, CodeLine, MosaicError

_MAKERS = ("mosaic_core.contract.", "abc", "pydantic.")
"""Modules whose code runs while a class is made."""


def wrong_declaration(cls: type, message: str, cure: str) -> MosaicError:
    """The error for a class that is being made, or for what an instance of it says."""
    at = _place_of(cls)
    place = f"{at[0]}:{at[1]}: " if at[0] else ""
    message = f"{place}{cls.__qualname__}: {message} {cure}"
    return MosaicError(message, code="config.broken_plugin", cure=cure, at=at)


def _place_of(cls: type) -> CodeLine:
    """That of the class statement that is being executed, else of the class."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith(_MAKERS):
        frame = frame.f_back
    if frame is not None and frame.f_globals.get("__name__") == cls.__module__:
        return frame.f_code.co_filename, frame.f_lineno
    try:
        return str(inspect.getsourcefile(cls)), inspect.getsourcelines(cls)[1]
    except (OSError, TypeError):
        return NOWHERE
