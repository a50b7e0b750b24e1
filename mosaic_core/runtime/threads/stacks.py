"""Reads what the event loop's thread does, as lines of a stack, and whose code each of them is."""

from __future__ import annotations

import asyncio
import os
import sys
import traceback
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import FrameType, ModuleType

import mosaic_core
from mosaic_core.contract.declared.code_lines import line_in
from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.loop_watch import StackFrame

_CORE = f"{Path(mosaic_core.__file__).parent}{os.sep}"
_ASYNCIO = f"{Path(asyncio.__file__).parent}{os.sep}"
_STANDARD = f"{Path(os.__file__).parent}{os.sep}"
_FROZEN = "<"
"""How Python's names of what is no file begin: ``<string>``, ``<frozen importlib._bootstrap>``."""
_LOOP_ITSELF = ("_run", "_run_once", "run", "run_forever", "run_until_complete")


def caller_of_core(frame: FrameType | None) -> FrameType | None:
    """The innermost frame from ``frame`` on that is not the framework's own."""
    while frame is not None and frame.f_code.co_filename.startswith(_CORE):
        frame = frame.f_back
    return frame


def place_of_thread(thread_id: int | None) -> str:
    """``FILE:LINE in NAME`` of the innermost line of a thread that is neither the framework's nor Python's own."""
    frame = sys._current_frames().get(thread_id or 0)
    while frame is not None and is_nobodys(frame.f_code.co_filename):
        frame = frame.f_back
    return line_in(frame)


def is_nobodys(file: str) -> bool:
    """Whether it is no author's: of the framework, or of Python's own library, which has installed packages inside."""
    is_standard = file.startswith(_STANDARD) and "site-packages" not in file
    return is_standard or file.startswith((_FROZEN, _CORE))


class PluginCode:
    """Knows which files are those of the plugins that made ``handlers``."""

    def __init__(self, handlers: Iterable[Handler]) -> None:
        self._labels: dict[str, set[str]] = {}
        """By place, of the handlers whose code lies there."""
        for handler in handlers:
            for source in _sources(handler):
                self._labels.setdefault(source, set()).add(handler.label)
        self._sources = tuple(self._labels)

    def place_of(self, error: BaseException) -> str:
        """``FILE:LINE in NAME`` of the innermost line of the plugins on the way of ``error``; else the innermost line
        that is not the framework's own, or nothing."""
        lines = [
            (frame.f_code, line)
            for one in _causes(error)
            for frame, line in traceback.walk_tb(one.__traceback__)
            if not frame.f_code.co_filename.startswith(_CORE)
        ]
        own = [(code, line) for code, line in lines if code.co_filename.startswith(self._sources)]
        code, line = next(reversed(own or lines), (None, 0))
        return f"{code.co_filename}:{line} in {code.co_qualname}" if code is not None else ""

    def stack_of(self, thread_id: int) -> list[StackFrame]:
        """What the event loop on this thread does now, the innermost line first. Any thread."""
        return list(self.stack_from(sys._current_frames().get(thread_id)))

    def stack_from(self, frame: FrameType | None) -> Iterator[StackFrame]:
        """From ``frame`` outward, as far as the event loop."""
        while frame is not None:
            code = frame.f_code
            if code.co_filename.startswith(_ASYNCIO) and code.co_name in _LOOP_ITSELF:
                return
            is_plugin = code.co_filename.startswith(self._sources) and not code.co_filename.startswith(_CORE)
            yield StackFrame(
                code.co_filename,
                frame.f_lineno,
                code.co_qualname,
                _label(frame) or (self._owner_of(code.co_filename) if is_plugin else ""),
                is_plugin=is_plugin,
                is_library=code.co_filename.startswith(_STANDARD),
            )
            frame = frame.f_back

    def _owner_of(self, file: str) -> str:
        """The one handler whose code this is, as in a task of its own; nothing where it may be one of several."""
        labels = {label for source, its in self._labels.items() if file.startswith(source) for label in its}
        return labels.pop() if len(labels) == 1 else ""


def _causes(error: BaseException) -> Iterator[BaseException]:
    """What led to an error that Python itself has put in the place of another, and the error."""
    if isinstance(error, BaseExceptionGroup):
        yield from _causes(error.exceptions[0])
    elif isinstance(error.__cause__, StopIteration | StopAsyncIteration):  # in a generator
        yield error.__cause__
    yield error


def _label(frame: FrameType) -> str:
    """Of the handler whose method this is."""
    owner = frame.f_locals.get("self")
    return owner.label if isinstance(owner, Handler) else ""


def _sources(handler: Handler) -> Iterator[str]:
    """Where the code of ``handler`` lies: the folder of a package, or the file of a module that stands alone."""
    for name in {cls.__module__ for cls in type(handler).__mro__[:-1]}:
        package = sys.modules.get(name.partition(".")[0])
        if package is not None and package is not mosaic_core:
            yield from _places(package)


def _places(module: ModuleType) -> Iterator[str]:
    folders = [f"{path}{os.sep}" for path in getattr(module, "__path__", ())]
    yield from folders or filter(None, [getattr(module, "__file__", None)])
