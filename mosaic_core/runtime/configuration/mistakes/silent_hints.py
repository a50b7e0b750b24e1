"""Tells of handlers from which nothing can come: no body that the framework calls, and no code that sends."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterator

from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelBidirectional,
    DataChannelSendable,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.threads.code_places import standing_at
from mosaic_core.words.errors import Problem

_BODIES: tuple[tuple[type[Handler], str, frozenset[str]], ...] = (
    (DataChannelSendable, "messages", frozenset({"send", "send_json", "send_string", "send_bytes", "send_burst"})),
    (MediaTrackHandler, "frames", frozenset({"send_frame"})),
    (AudioTrackHandler, "sounds", frozenset({"send_sound"})),
    (AudioReceivable, "handle_sound", frozenset()),
)
"""By base: what the framework calls, and what an author's own code may call instead."""


def silent_hints(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Handlers whose author wrote a body under a name that nobody calls, or none."""
    for handler in handlers:
        kind = type(handler)
        base, name, sends = next((its for its in _BODIES if isinstance(handler, its[0])), (None, "", frozenset[str]()))
        if base is None or isinstance(handler, DataChannelBidirectional) or kind.__module__.startswith("mosaic_core."):
            continue
        if getattr(kind, name) is not getattr(base, name) or _package_reads(kind, sends):
            continue
        own = [key for key, value in vars(kind).items() if callable(value) and not key.startswith("_")]
        called = f", and nobody calls its {own[0]}()" if len(own) == 1 else ""
        message = f"nothing comes from '{handler.label}': {kind.__name__} has no {name}(){called}"
        yield one.problem(message, cure=f"write {name} in {kind.__name__}{standing_at(kind)}")


def _package_reads(kind: type, names: frozenset[str]) -> bool:
    """Whether a module of its package, as far as that is imported, reads an attribute of one of these names; true
    where a source can't be read."""
    top = kind.__module__.partition(".")[0]
    for module in [one for name, one in sys.modules.items() if name.partition(".")[0] == top]:
        try:
            tree = ast.parse(inspect.getsource(module))
        except (OSError, TypeError, SyntaxError):
            if module.__name__ == kind.__module__:
                return True
            continue
        if any(isinstance(one, ast.Attribute) and one.attr in names for one in ast.walk(tree)):
            return True
    return False
