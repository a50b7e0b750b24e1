"""Finds the connectors that stand beside a robot's YAML file: each ``connectors/*.py`` with a configurer is a plugin.

Finding them reads the files and runs none of them: a file is imported when a configuration uses a type of it, below a
package of the folder's own, so that its name hides no installed module. Siblings import each other by ``from .driver
import …``.
"""

from __future__ import annotations

import ast
import logging
import re
import sys
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from itertools import islice
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from mosaic_core.runtime.configuration.folder_trust import doubt_about
from mosaic_core.words.errors import CodeLine, MosaicError, Problem, nearest

FOLDER = "connectors"
_CONFIGURERS = {"Configurer", "DataChannelConfigurer", "MediaTrackConfigurer"}

_NO_CODE = frozenset({"tests", "test", "venv", "site-packages", "node_modules"})
"""Folders in which nobody means a connector of a robot."""
_MANY_FILES = 200
"""As many are read in folders of the folder."""

_TYPE = re.compile(r"""^[ \t]+connector_type\s*(?::[^=\n]*)?=\s*["']([^"'\n]+)["']""", re.MULTILINE)
"""In a file that can't be parsed."""

logger = logging.getLogger(__name__)

_told: set[Path] = set()
"""The files of which this process has said that it runs their code."""


@dataclass(frozen=True, slots=True)
class LocalConnector:
    """One connector type and the class of a file that makes it; known without running the file."""

    type: str
    file: Path
    line: int
    class_name: str
    unreadable: Problem | None = None
    """Why its file can't be parsed, where it can't: nobody knows its class then."""

    @property
    def source(self) -> str:
        """``connectors/….py``."""
        return f"{self.file.parent.name}/{self.file.name}"

    @property
    def entry_point(self) -> EntryPoint:
        """What :meth:`prepare` makes loadable."""
        value = f"{self._module}:{self.class_name}" if self.class_name else self._module
        return EntryPoint(self.type, value, "mosaic.connectors")

    def prepare(self) -> None:
        """Let the file be imported, and say once in the log that its code runs, however often that is reloaded."""
        if self._package not in sys.modules:
            package = ModuleType(self._package, "The connectors of one folder.")
            package.__path__ = [str(self.file.parent)]
            sys.modules[self._package] = package
        if self.file not in _told:
            _told.add(self.file)
            logger.warning("runs code of %s", self.file)

    def explained(self, error: BaseException) -> tuple[str, str | None, CodeLine]:
        """Why the file could not be imported, with the line of the folder where it happened; the cure if the author of
        the error knows one; and that line."""
        # Only now: a list of connectors explains no error, and needs no pydantic.
        from mosaic_core.runtime.threads.error_words import said_by

        if isinstance(error, MosaicError) and error.code == "config.broken_plugin":  # whose message begins with it
            return error.message.removesuffix(error.cure).rstrip(), error.cure, error.at
        frames = [frame for frame in extract_tb(error.__traceback__) if Path(frame.filename).parent == self.file.parent]
        at = CodeLine(frames[-1].filename, frames[-1].lineno) if frames else CodeLine(str(self.file))
        if isinstance(error, SyntaxError):
            at = CodeLine(error.filename or at.file, error.lineno)
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        return f"{at.heading}{said_by(error)}", self._cure_of(missing) if missing else None, at

    def _cure_of(self, missing: str) -> str:
        """What to do about a module that is not there."""
        if self.file.with_name(f"{missing}.py").is_file():
            return f"for the file beside it write `from .{missing} import …`"
        return f"install what has the module {missing}, or correct its name"

    @property
    def _package(self) -> str:
        """Differs from folder to folder, as a process may know several."""
        return f"local_connectors_{zlib.crc32(str(self.file.parent).encode()):08x}"

    @property
    def _module(self) -> str:
        return f"{self._package}.{self.file.stem}"


@dataclass(frozen=True, slots=True)
class LocalConnectors:
    """The connectors of one folder, and what is wrong with its files. ``refusal`` says why none of them is run; empty
    if they may be, or if there are none."""

    connectors: tuple[LocalConnector, ...] = ()
    problems: tuple[Problem, ...] = ()
    refusal: str = ""


def connectors_beside(config: Path, *, refusal: str = "") -> LocalConnectors:
    """What the folder ``connectors`` beside ``config`` offers. ``refusal``: why its code must not be run, if so.

    Its code is refused as well where others than the author of ``config`` could have written it.
    """
    folder = config.resolve().parent / FOLDER
    found = connectors_in(*sorted(folder.glob("*.py")))
    found = replace(found, problems=(*found.problems, *_too_deep(folder)))
    return replace(found, refusal=refusal or doubt_about(folder, config)) if found.connectors else found


def connectors_in(*files: Path) -> LocalConnectors:
    """What these files offer, without running them."""
    found = [one for file in files for one in _found_in(file.resolve())]
    connectors = tuple(one for one in found if isinstance(one, LocalConnector))
    return LocalConnectors(connectors, tuple(one for one in found if isinstance(one, Problem)))


def _found_in(file: Path) -> Iterator[LocalConnector | Problem]:
    text = ""
    try:
        text = file.read_text("utf-8")
        tree = ast.parse(text, str(file))
    except (OSError, SyntaxError, ValueError) as error:
        line = error.lineno if isinstance(error, SyntaxError) else None
        cause = error.msg if isinstance(error, SyntaxError) else str(error)
        unreadable = _problem(
            file, line, f"{type(error).__name__}: {cause}", "mend it; until then its connectors are left out"
        )
        yield unreadable
        for found in _TYPE.finditer(text):
            yield LocalConnector(found[1], file, text.count("\n", 0, found.start(1)) + 1, "", unreadable)
        return
    classes = list({node.name: node for node in reversed([*_classes_of(tree.body)])}.values())[::-1]
    inherited = {_name(base) for node in classes for base in node.bases}
    yield from _out_of_reach(file, tree, classes)
    for node in classes:
        named = _type_of(node)
        if named is not None:
            yield _connector(file, node, named)
        elif node.name not in inherited and _CONFIGURERS & {_name(base) for base in node.bases}:
            yield _untyped(file, node)


def _classes_of(statements: Iterable[ast.AST]) -> Iterator[ast.ClassDef]:
    """The classes of a module, also those that stand in an ``if``, a ``try`` or a ``with``."""
    for node in statements:
        if isinstance(node, ast.ClassDef):
            yield node
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.expr):
            yield from _classes_of(ast.iter_child_nodes(node))


def _out_of_reach(file: Path, tree: ast.Module, found: Sequence[ast.ClassDef]) -> Iterator[Problem]:
    """Configurers that stand inside a function or a class, where nobody looks for them."""
    for node in ast.walk(tree):
        is_meant = isinstance(node, ast.ClassDef) and _type_of(node) and _CONFIGURERS & {*map(_name, node.bases)}
        if isinstance(node, ast.ClassDef) and is_meant and node.name not in {one.name for one in found}:
            message = f"{node.name} stands inside a function or a class, where no connector is found"
            yield _problem(file, node.lineno, message, "write it at the left margin of the file")


def _too_deep(folder: Path) -> Iterator[Problem]:
    """Connectors in folders of the folder, where nobody looks for them."""
    inner = (file for file in sorted(folder.glob("*/**/*.py")) if not _is_elsewhere(file.relative_to(folder)))
    for file in islice(inner, _MANY_FILES):
        for one in connectors_in(file).connectors:
            message = f"the connector type '{one.type}' stands in a folder of {FOLDER}/, where none is found"
            yield _problem(
                file, one.line, message, f"move the file into {FOLDER}/ itself, or remove its connector_type"
            )


def _is_elsewhere(file: Path) -> bool:
    """Whether a file is of an environment or of tests."""
    return any(part.startswith((".", "__")) or part in _NO_CODE for part in file.parts[:-1])


def _untyped(file: Path, node: ast.ClassDef) -> Problem:
    """A configurer without a ``connector_type``, with the name that was written instead of it."""
    assigned = [one for one in node.body if isinstance(one, ast.Assign | ast.AnnAssign)]
    names = [name for one in assigned for name in ast.walk(one) if isinstance(name, ast.Name)]
    lines = {name.id: name.lineno for name in names if isinstance(name.ctx, ast.Store)}
    written = nearest("connector_type", lines)
    if written is None:
        return _problem(file, node.lineno, f"{node.name} has no connector_type", _like(node.name))
    message = f"{node.name} has no connector_type, but '{written}'"
    return _problem(file, lines[written], message, "write connector_type instead")


def _connector(file: Path, node: ast.ClassDef, named: ast.expr) -> LocalConnector | Problem:
    if not isinstance(named, ast.Constant) or not isinstance(named.value, str) or not named.value:
        return _problem(file, node.lineno, f"connector_type of {node.name} is no plain text", _like(node.name))
    if not file.stem.isidentifier():
        cure = "rename the file: letters, digits and _ alone"
        return _problem(file, node.lineno, f"{file.name} can't be imported by its name", cure)
    return LocalConnector(named.value, file, node.lineno, node.name)


def _problem(file: Path, line: int | None, message: str, cure: str) -> Problem:
    return Problem(message, "config.broken_local", file=str(file), line=line, cure=cure)


def _type_of(node: ast.ClassDef) -> ast.expr | None:
    """What the class says its ``connector_type`` is."""
    for statement in node.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id="connector_type")], value=value):
                return value
            case ast.AnnAssign(target=ast.Name(id="connector_type"), value=value):
                return value
    return None


def _name(base: ast.expr) -> str:
    """``DataChannelConfigurer`` of ``mosaic_core.DataChannelConfigurer[ArmParams]``."""
    match base:
        case ast.Subscript(value=value):
            return _name(value)
        case ast.Attribute(attr=name) | ast.Name(id=name):
            return name
    return ""


def _like(class_name: str) -> str:
    return f"write for example connector_type = '{class_name.removesuffix('Configurer').lower() or 'arm'}'"
