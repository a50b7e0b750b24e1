"""Knows the modules of a robot's own code, who imports whom, and lets them be imported anew.

Own code is what stands beside the YAML file or is installed in place (``pip install -e``); libraries and the framework
itself stay as they are.
"""

from __future__ import annotations

import ast
import importlib
import linecache
import sys
import sysconfig
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import lru_cache
from importlib.util import cache_from_source
from pathlib import Path
from types import ModuleType

import mosaic_core

_LIBRARIES = tuple(
    str(Path(path).resolve()) for path in {sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")}
)
_CORE = str(Path(mosaic_core.__file__).parent.resolve())


def own_modules(roots: Iterable[str]) -> dict[str, Path]:
    """The modules of own code that the modules ``roots`` are made of: themselves and what they import, by name."""
    files = {name: getattr(module, "__file__", None) for name, module in list(sys.modules.items())}
    loaded = {name: own for name, file in files.items() if isinstance(file, str) and (own := _own_file(file))}
    found: dict[str, Path] = {}
    waiting = [name for name in roots if name in loaded]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found[name] = loaded[name]
            waiting += imported_by(name, loaded)
    return found


@lru_cache(maxsize=4096)
def _own_file(file: str) -> Path | None:
    """Asked of some thousand modules at each reload; where a path leads stays the same."""
    if not file.endswith(".py"):
        return None
    path = Path(file).resolve()
    return None if str(path).startswith((*_LIBRARIES, _CORE)) else path


def imported_by(name: str, modules: Mapping[str, Path]) -> set[str]:
    """Those of ``modules`` that the module ``name`` imports; its packages among them."""
    parents = {name.rpartition(".")[0]} if "." in name else set()
    try:
        named = _all_named(name, modules[name], modules[name].stat().st_mtime_ns)
    except OSError:
        named = frozenset[str]()
    return {*named, *parents} & modules.keys() - {name}


@lru_cache(maxsize=4096)
def _all_named(name: str, file: Path, mtime_ns: int) -> frozenset[str]:
    """Every module that a file may import. Parsed once for each time that it is saved: to parse all of them again and
    again would hold up whoever else runs Python."""
    try:
        tree = ast.parse(file.read_text("utf-8"))
    except (OSError, SyntaxError, ValueError):
        return frozenset()  # whoever imports it hears of it
    is_package = file.name == "__init__.py"
    return frozenset(one for node in ast.walk(tree) for one in _named(node, name, is_package=is_package))


def _named(node: ast.AST, importer: str, *, is_package: bool) -> Iterator[str]:
    """Every module that a statement may mean, with the packages around it."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield from _with_parents(alias.name)
    if isinstance(node, ast.ImportFrom):
        parts = importer.split(".") if is_package else importer.split(".")[:-1]
        base = ".".join(parts[: len(parts) - node.level + 1]) if node.level else ""
        module = ".".join(part for part in (base, node.module or "") if part)
        yield from _with_parents(module)
        yield from (f"{module}.{alias.name}" for alias in node.names)


def _with_parents(name: str) -> Iterator[str]:
    parts = name.split(".")
    yield from (".".join(parts[:count]) for count in range(1, len(parts) + 1))


def touched_by(changed: Collection[Path], modules: Mapping[str, Path]) -> frozenset[str]:
    """The modules whose code is another one than before: those of changed files, and who imports them."""
    imports = {name: imported_by(name, modules) for name in modules}
    found = {name for name, file in modules.items() if file in changed}
    while more := {name for name, used in imports.items() if used & found} - found:
        found |= more
    return frozenset(found)


class ForgottenModules:
    """Lets modules be imported anew: they are forgotten now, and :meth:`restore` brings the old ones back."""

    def __init__(self, names: Collection[str]) -> None:
        self._names = tuple(names)
        self._modules = {name: sys.modules.pop(name) for name in names if name in sys.modules}
        self._unbind()
        for module in self._modules.values():
            _drop_bytecode(module)
        importlib.invalidate_caches()
        linecache.checkcache()

    def restore(self) -> None:
        """What came in their place was of no use."""
        for name in self._names:
            sys.modules.pop(name, None)
        self._unbind()
        sys.modules.update(self._modules)
        for name, module in self._modules.items():
            parent, _, child = name.rpartition(".")
            if parent in sys.modules:
                setattr(sys.modules[parent], child, module)

    def _unbind(self) -> None:
        """A package keeps its modules as attributes, and ``from package import module`` takes those first."""
        for name in self._names:
            parent, _, child = name.rpartition(".")
            if parent in sys.modules:
                vars(sys.modules[parent]).pop(child, None)


def _drop_bytecode(module: ModuleType) -> None:
    """It is told from the source by size and second: too coarse for somebody who saves twice."""
    file = getattr(module, "__file__", None)
    if isinstance(file, str):
        try:
            Path(cache_from_source(file)).unlink(missing_ok=True)
        except (OSError, NotImplementedError):
            return  # it will be found to be old, or not
