"""Tells of handlers from which nothing can come: no body that the framework calls or none that yields, and no code that
sends; and of what a receiver returns, which goes nowhere."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

from mosaic_core.contract.declared.attribute_reads import package_reads
from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelBidirectional,
    DataChannelReceivable,
    DataChannelSendable,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.words.errors import Problem

_BODIES: tuple[tuple[type[Handler], str, frozenset[str]], ...] = (
    (DataChannelSendable, "messages", frozenset({"send", "send_json", "send_string", "send_bytes", "send_burst"})),
    (MediaTrackHandler, "frames", frozenset({"send_frame"})),
    (AudioTrackHandler, "sounds", frozenset({"send_sound"})),
    (AudioReceivable, "handle_sound", frozenset()),
)
"""By base: what the framework calls, and what an author's own code may call instead."""


def silent_hints(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Handlers whose author wrote a body under a name that nobody calls, one that yields nothing, or none; and those
    that return what they mean to send."""
    for handler in handlers:
        if type(handler).__module__.startswith("mosaic_core."):
            continue
        wrong = _unheard(handler) if isinstance(handler, DataChannelReceivable) else _silence(type(handler))
        if wrong is not None:
            what, cure = wrong
            yield one.problem(f"nothing comes from '{handler.label}': {what}", cure=cure)


def _silence(kind: type[Handler]) -> tuple[str, str] | None:
    """What keeps it from sending anything, and the cure."""
    base, name, sends = next((its for its in _BODIES if issubclass(kind, its[0])), (None, "", frozenset[str]()))
    if base is None:
        return None
    body = getattr(kind, name)
    if body is not getattr(base, name):
        if not sends or not _yields_nothing(body) or package_reads(kind, sends):
            return None
        return f"{name}() of {kind.__name__} yields nothing", f"yield what it shall send{standing_at(kind)}"
    if package_reads(kind, sends):
        return None
    own = [key for key, value in vars(kind).items() if callable(value) and not key.startswith("_")]
    called = f", and nobody calls its {own[0]}()" if len(own) == 1 else ""
    return f"{kind.__name__} has no {name}(){called}", f"write {name} in {kind.__name__}{standing_at(kind)}"


def _yields_nothing(body: Callable[..., Any]) -> bool:
    """Whether it is plainly a function that runs to its end, and returns nothing that could be iterated."""
    is_stream = inspect.isgeneratorfunction(body) or inspect.isasyncgenfunction(body)
    return inspect.isfunction(body) and not is_stream and _returned_by(body) == []


def _unheard(handler: DataChannelReceivable[Any]) -> tuple[str, str] | None:
    """What its ``handle_data`` returns as if somebody got it, and the cure."""
    kind = type(handler)
    if not any(map(_is_message, _returned_by(kind.handle_data) or ())):
        return None
    is_both = isinstance(handler, DataChannelBidirectional)
    instead = "self.send_json(…, to=sender)" if is_both else "a RequestHandler, which has an answer"
    return (
        f"what handle_data of {kind.__name__} returns goes nowhere",
        f"write {instead}{standing_at(kind.handle_data)}",
    )


def _is_message(value: ast.expr) -> bool:
    """A mapping, a list, or an object of a class; not what a function is called for."""
    name = getattr(value.func, "attr", getattr(value.func, "id", "")) if isinstance(value, ast.Call) else ""
    return isinstance(value, ast.Dict | ast.List) or name[:1].isupper()


def _returned_by(function: Callable[..., Any]) -> list[ast.expr] | None:
    """What its code returns; ``None`` where nobody can read it."""
    try:
        (definition,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    except (OSError, TypeError, SyntaxError, ValueError):
        return None
    found: list[ast.expr] = []
    waiting: list[ast.AST] = [*getattr(definition, "body", ())]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Return) and node.value is not None:
            found.append(node.value)
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            waiting += ast.iter_child_nodes(node)
    return found
