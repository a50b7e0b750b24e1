"""Makes the error for what an author declares, or calls with: it names the file and line, and the cure."""

from __future__ import annotations

import inspect
from types import FrameType

from mosaic_core.words.errors import NOWHERE, CodeLine, MosaicError

_MAKERS = ("mosaic_core.contract.", "abc", "pydantic.")
"""Modules whose code runs while a class is made, or something of the contract is called."""


def wrong_declaration(cls: type, message: str, cure: str) -> MosaicError:
    """The error for a class that is being made, or for what an instance of it says."""
    return _mistake(_place_of(cls), f"{cls.__qualname__}: {message}", cure)


def wrong_call(message: str, cure: str) -> MosaicError:
    """The error for what somebody's code gave the function of ours that it called."""
    frame = _author_frame()
    return _mistake(NOWHERE if frame is None else _line_of(frame), message, cure)


def _mistake(at: CodeLine, message: str, cure: str) -> MosaicError:
    place = f"{at[0]}:{at[1]}: " if at[0] else ""
    return MosaicError(f"{place}{message} {cure}", code="config.broken_plugin", cure=cure, at=at)


def _place_of(cls: type) -> CodeLine:
    """That of the class statement that is being executed, else of the class."""
    frame = _author_frame()
    if frame is not None and frame.f_globals.get("__name__") == cls.__module__:
        return _line_of(frame)
    try:
        return str(inspect.getsourcefile(cls)), inspect.getsourcelines(cls)[1]
    except (OSError, TypeError):
        return NOWHERE


def _author_frame() -> FrameType | None:
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith(_MAKERS):
        frame = frame.f_back
    return frame


def _line_of(frame: FrameType) -> CodeLine:
    return frame.f_code.co_filename, frame.f_lineno
