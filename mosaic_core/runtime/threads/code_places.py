"""Names the line of a plugin's code that an error comes from, or that a thread is at."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Iterable
from pathlib import Path
from traceback import FrameSummary, extract_tb

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.runtime.threads.error_words import said_by, words_of
from mosaic_core.words.errors import NOWHERE, CodeLine, MosaicError

_CORE = f"{Path(__file__).parents[2]}{os.sep}"
_STANDARD = f"{Path(os.__file__).parent}{os.sep}"
_PACKAGES = frozenset({"site-packages", "dist-packages"})
"""Folders inside that of the standard library, with what is installed."""


def explained_error(error: BaseException) -> str:
    """An error of a plugin's code for its author: what it says, and the file and line where it was raised."""
    if isinstance(error, MosaicError) and error.code == "config.broken_plugin":
        return error.message  # which begins with the place
    at = raised_at(error)
    return said_by(error) + (at.in_brackets if str(at) not in words_of(error) else "")


def raised_at(error: BaseException) -> CodeLine:
    """The plugin's code that it speaks of, or where it was raised."""
    if isinstance(error, MosaicError) and error.at.file:
        return error.at
    if isinstance(error, SyntaxError) and error.filename:
        return CodeLine(error.filename, error.lineno)
    place = innermost_own(extract_tb(error.__traceback__))
    return raised_at(error.__cause__) if not place.file and error.__cause__ is not None else place


def innermost_own(frames: Iterable[FrameSummary]) -> CodeLine:
    """File and line of the innermost frame that is not the framework's, the import system's, or, where there is
    another one, the standard library's or that of the models of messages and params."""
    others = [frame for frame in frames if not frame.filename.startswith(("<frozen", _CORE))]
    others = [frame for frame in others if "importlib" not in Path(frame.filename).parts]
    own = [frame for frame in others if not _is_standard(frame.filename)]
    inner = next(reversed(own or others), None)
    return CodeLine(inner.filename, inner.lineno) if inner is not None else NOWHERE


def is_own(file: str) -> bool:
    """Whether it is code that somebody here writes: what stands in a folder of theirs, also where it is installed in
    place."""
    return bool(file) and not file.startswith(_STANDARD) and not _PACKAGES.intersection(Path(file).parts)


def _is_standard(file: str) -> bool:
    return "pydantic" in Path(file).parts or (
        file.startswith(_STANDARD) and not _PACKAGES.intersection(Path(file).parts)
    )


def said_at(cls: type, name: str) -> CodeLine:
    """Where ``cls``, or the base that has it, says ``name = …``, ``name: …`` or ``def name``; else where it stands."""
    owner = next((one for one in cls.__mro__ if name in vars(one) or name in vars(one).get("__annotations__", {})), cls)
    file, first = stands = code_of(owner)
    if first is None:
        return stands
    wanted = re.compile(rf"\s+(?:async\s+)?(?:def\s+)?{re.escape(name)}\s*[:=(]")
    lines = inspect.getsourcelines(owner)[0]
    return CodeLine(file, first + next((number for number, line in enumerate(lines) if wanted.match(line)), 0))
