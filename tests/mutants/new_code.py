"""How a mutant gets into a process: as another source for a module that is imported, or, where only functions have
changed, as new code for the functions that are there already."""

from __future__ import annotations

import gc
import importlib.abc
import importlib.machinery
import importlib.util
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

Codes = list[tuple[FunctionType, CodeType]]
"""Functions, each with the code that it gets instead of its own."""


def changes_functions(path: Path, original: str, mutated: str) -> bool:
    """Whether the mutant changes functions alone, nothing that runs at import."""
    return _changed(compile(original, str(path), "exec"), compile(mutated, str(path), "exec")) is not None


def functions_of(path: Path) -> list[FunctionType]:
    """All functions that the import of the module at ``path`` has made."""
    gc.unfreeze()
    return [one for one in gc.get_objects() if isinstance(one, FunctionType) and one.__code__.co_filename == str(path)]


def swapped(path: Path, live: list[FunctionType], original: str, mutated: str) -> Codes:
    """Those of the ``live`` functions that the mutant changes, with their new code."""
    changed = _changed(compile(original, str(path), "exec"), compile(mutated, str(path), "exec")) or []
    return [(one, new) for one in live for old, new in changed if one.__code__ == old]


def _changed(before: CodeType, after: CodeType) -> list[tuple[CodeType, CodeType]] | None:
    """Pairs of functions; ``None`` if the code around them differs."""
    old, new = (tuple(one for one in code.co_consts if isinstance(one, CodeType)) for code in (before, after))
    if _own(before) != _own(after) or len(old) != len(new):
        return None
    pairs: list[tuple[CodeType, CodeType]] = []
    for one, other in zip(old, new, strict=True):
        if one.co_flags & inspect.CO_OPTIMIZED:
            pairs += [(one, other)] if one != other else []
        elif (inner := _changed(one, other)) is None:
            return None
        else:
            pairs += inner
    return pairs


def _own(code: CodeType) -> tuple[object, ...]:
    """What a module or the body of a class does itself."""
    constants = [repr(one) for one in code.co_consts if not isinstance(one, CodeType)]
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_qualname


class MutantFinder(importlib.abc.MetaPathFinder):
    """Gives the mutated source for one module, and tells ``reached`` which others were complete before anybody asked
    for it."""

    def __init__(self, path: Path, name: str, source: str, reached: Callable[[list[str]], None]) -> None:
        self._path, self._name, self._source, self._reached = path, name, source, reached

    def find_spec(self, name: str, path: Any, target: ModuleType | None = None) -> Any:
        if name != self._name:
            return None
        self._reached([name for name in list(sys.modules) if _is_complete(name)])
        return importlib.util.spec_from_file_location(name, self._path, loader=_Loader(name, self._path, self._source))


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: Path, source: str) -> None:
        super().__init__(name, str(path))
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._source, self.path, "exec", dont_inherit=True)


def _is_complete(name: str) -> bool:
    """It and the packages around it, which are imported with it."""
    parents = [name.rsplit(".", depth)[0] for depth in range(name.count(".") + 1)]
    specs = [getattr(sys.modules.get(one), "__spec__", None) for one in parents]
    if any(spec is None or getattr(spec, "_initializing", False) for spec in specs):
        return False
    return not name.startswith(("tests", "test_", "plugins")) and "conftest" not in name
