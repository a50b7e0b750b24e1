"""Finds the file and line of classes, fields and errors, for the author who shall mend them."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import mosaic_core
from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.runtime.threads.code_places import said_at
from mosaic_core.runtime.threads.stacks import is_nobodys
from mosaic_core.words.errors import NOWHERE, CodeLine

CORE_FOLDER = str(Path(mosaic_core.__file__).parent)
_FROZEN = "<"
"""How Python's names of what is no file begin: ``<string>``, ``<frozen importlib._bootstrap>``."""


def place_of_class(cls: type[Any]) -> CodeLine:
    """The line of its ``class`` statement; without a line where its source can't be read."""
    at = code_of(cls)
    return at if at.file else CodeLine(cls.__module__)


def place_of_attribute(cls: type[Any], name: str) -> CodeLine:
    """The line where ``cls``, or the base that has it, says ``name = …``, ``name: …`` or ``def name``."""
    at = said_at(cls, name)
    return at if at.file else place_of_class(cls)


def place_of_field(model: type[BaseModel], name: str) -> CodeLine:
    """The line of one field of a model, which a base may have declared."""
    owner = next((one for one in model.__mro__ if name in vars(one).get("__annotations__", {})), model)
    return place_of_attribute(owner, name)


def place_of_error(error: BaseException, packages: Iterable[str] = ()) -> CodeLine:
    """The innermost line of ``packages`` on the way of an error; else the innermost that is not the framework's."""
    if isinstance(error, SyntaxError) and error.filename:
        return CodeLine(error.filename, error.lineno)
    return place_of_frames(traceback.extract_tb(error.__traceback__), packages)


def place_of_frames(stack: Iterable[traceback.FrameSummary], packages: Iterable[str] = ()) -> CodeLine:
    """The innermost line of ``packages`` in a stack, else the innermost that is neither the framework's nor Python's
    own library."""
    frames = [frame for frame in stack if not is_nobodys(frame.filename)]
    named = tuple(f"/{one}/" for one in packages) + tuple(f"/{one}.py" for one in packages)
    own = [frame for frame in frames if any(one in frame.filename for one in named)]
    last = (own or frames)[-1:]
    return CodeLine(last[0].filename, last[0].lineno) if last else NOWHERE


def trace_of(error: BaseException) -> str:
    """The traceback of an error as its author would see it: without the frames that imported the plugin, and
    those of the framework in which it ended."""
    frames = traceback.extract_tb(error.__traceback__)
    first = next((at for at, frame in enumerate(frames) if not frame.filename.startswith((_FROZEN, CORE_FOLDER))), 0)
    kept = [frame for frame in frames[first:] if not frame.filename.startswith(_FROZEN)]
    kept = [frame for frame in kept if "importlib" not in Path(frame.filename).parts]
    while kept and kept[-1].filename.startswith(CORE_FOLDER):
        kept.pop()
    lines = traceback.format_list(kept) if kept else []
    head = ["Traceback (most recent call last):\n"] if lines else []
    return "".join([*head, *lines, *traceback.format_exception_only(error)]).rstrip()


def line_of_entry(file: Path, entry_point: EntryPoint) -> CodeLine:
    """The line of a ``pyproject.toml`` that names an entry point."""
    try:
        lines = file.read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return CodeLine(str(file))
    wanted = re.compile(rf"\s*[\"']?{re.escape(entry_point.name)}[\"']?\s*=\s*[\"']{re.escape(entry_point.value)}")
    at = next((number for number, line in enumerate(lines, 1) if wanted.match(line)), None)
    return CodeLine(str(file), at)
