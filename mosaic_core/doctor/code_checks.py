"""Checks the source of connectors for what blocks a robot's event loop, told before it costs an operator the
connection."""

from __future__ import annotations

import ast
import asyncio
import sys
from collections.abc import AsyncIterator, Iterator, Mapping
from itertools import product
from pathlib import Path

from mosaic_core.doctor.config_checks import ConfigRead
from mosaic_core.runtime.configuration.local_connectors import FOLDER
from mosaic_core.words.finding import Finding, passed, skipped, warned

MAX_FILES = 200
"""Of one package."""


_VERBS = ("get", "post", "put", "patch", "delete", "head", "options", "request")
WAITS = frozenset({
    "time.sleep", "os.system", "os.wait", "input", "urllib.request.urlopen", "serial.Serial", "cv2.VideoCapture",
    "subprocess.run", "subprocess.call", "subprocess.check_call", "subprocess.check_output", "subprocess.getoutput",
    "socket.create_connection", "socket.getaddrinfo", "socket.gethostbyname",
    *(".".join(words) for words in product(("requests", "httpx"), _VERBS)),
})  # fmt: skip
"""Functions that return when something outside has answered."""


def blocking_lines(source: str) -> Iterator[tuple[int, str]]:
    """``(line, what)`` of what would block in an ``async def``: a plain ``for`` over ``every``, ``self.pause``,
    ``request.pause``, a call of one of :data:`WAITS`. Raises :class:`SyntaxError`."""
    tree = ast.parse(source)
    names = dict(_imported(tree))
    for function in ast.walk(tree):
        if isinstance(function, ast.AsyncFunctionDef):
            yield from _blocking(function, names)


def _imported(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """What imported names stand for, dotted."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.asname, alias.name) for alias in node.names if alias.asname)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from ((alias.asname or alias.name, f"{node.module}.{alias.name}") for alias in node.names)


def _dotted(function: ast.expr, names: Mapping[str, str]) -> str:
    """``subprocess.run`` of what is called, whatever it was imported as; empty for what no name says."""
    parts: list[str] = []
    while isinstance(function, ast.Attribute):
        parts.append(function.attr)
        function = function.value
    if not isinstance(function, ast.Name):
        return ""
    return ".".join((names.get(function.id, function.id), *reversed(parts)))


def _blocking(function: ast.AsyncFunctionDef, names: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    waiting: list[ast.AST] = [*function.body]
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue  # runs somewhere else, or is looked at by itself
        match node:
            case ast.For(iter=ast.Call(func=ast.Attribute(attr="every"))):
                yield node.lineno, "for … in every(…)"
            case ast.Call(func=ast.Attribute(value=ast.Name(id="self" | "request" as whose), attr="pause")):
                yield node.lineno, f"{whose}.pause(…)"
            case ast.Call(func=called) if _dotted(called, names) in WAITS:
                yield node.lineno, f"{_dotted(called, names)}(…)"
            case _:
                pass
        waiting += ast.iter_child_nodes(node)


async def code_checks(read: ConfigRead) -> AsyncIterator[Finding]:
    """The source of every package that the connectors of the file come from."""
    if not read.connectors:
        yield skipped("code.connectors", "No connector of the file could be read, so no code is looked at.")
    packages = {one.configurer.__module__.partition(".")[0]: one.installed.local for one in read.connectors}
    packages.pop("mosaic_core", None)
    for package, local in sorted(packages.items(), key=lambda one: one[0]):
        name, where = (package, package) if local is None else (FOLDER, str(local.file.parent))
        found = await asyncio.to_thread(_found_in, package)
        for place, what in found:
            facts = {"place": place}
            text = f"{place}: {what} in an `async def` stops the whole robot while it waits."
            yield warned(f"code.{name}", "plugin.blocks_loop", text, facts=facts)
        if not found:
            yield passed(f"code.{name}", f"Nothing in {where} is seen to block the event loop.")


def _found_in(package: str) -> list[tuple[str, str]]:
    module = sys.modules.get(package)
    folders = [Path(path) for path in getattr(module, "__path__", ())]
    single = getattr(module, "__file__", None)
    files = [file for folder in folders for file in sorted(folder.rglob("*.py"))] or ([Path(single)] if single else [])
    found: list[tuple[str, str]] = []
    for file in files[:MAX_FILES]:
        try:
            lines = list(blocking_lines(file.read_text(encoding="utf-8")))
        except (OSError, SyntaxError, ValueError):
            continue  # what can't be read is the business of whoever imports it
        found += [(f"{file}:{line}", what) for line, what in lines]
    return found
