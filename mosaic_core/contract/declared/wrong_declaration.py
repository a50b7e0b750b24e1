"""Makes the error for what an author declares, calls with, or sends: it names the file and line, and the cure."""

from __future__ import annotations

from mosaic_core.contract.declared.code_lines import author_frame, code_of, line_of
from mosaic_core.words.errors import CodeLine, MosaicError


def wrong_declaration(cls: type, message: str, cure: str) -> MosaicError:
    """The error for a class that is being made, or for what an instance of it says."""
    frame = author_frame()
    is_being_made = frame is not None and frame.f_globals.get("__name__") == cls.__module__
    return _mistake(line_of(frame) if is_being_made else code_of(cls), f"{cls.__qualname__}: {message}", cure)


def wrong_call(message: str, cure: str) -> MosaicError:
    """The error for what somebody's code gave the function of ours that it called."""
    return _mistake(line_of(author_frame()), message, cure)


def called(thing: object) -> str:
    """How an error calls what somebody gave: by its class."""
    return "None" if thing is None else f"a {type(thing).__qualname__}"


def _mistake(at: CodeLine, message: str, cure: str) -> MosaicError:
    return MosaicError(f"{at.heading}{message} {cure}", code="config.broken_plugin", cure=cure, at=at)


def wrong_message(whose: str, at: CodeLine, what: str, cure: str | None = None) -> MosaicError:
    """The error for what the class or body ``whose``, which stands ``at`` a line, sends or answers; ``what`` begins
    with a verb."""
    return MosaicError(f"{whose}{at.in_brackets} {what}", code="plugin.wrong_message", cure=cure)
