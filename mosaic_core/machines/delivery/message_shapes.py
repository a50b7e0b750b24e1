"""Remembers the shapes of messages that were checked: what comes hundreds of times a second is checked once."""

from __future__ import annotations

from typing import Any, TypeAlias

MessageShape: TypeAlias = tuple[Any, ...] | type
MAX_SHAPES = 64
"""Of one class. Keys that differ in every message are no shape; then all begins anew."""


def shape_of(value: Any) -> MessageShape:
    """The class of a message; of a mapping its keys and the classes of their values, in their order."""
    return (*value, *map(type, value.values())) if isinstance(value, dict) else type(value)


class MessageShapes:
    """The shapes that were found good. Any thread."""

    def __init__(self) -> None:
        self._known: set[MessageShape] = set()

    def is_known(self, shape: MessageShape) -> bool:
        return shape in self._known

    def add(self, shape: MessageShape) -> None:
        if len(self._known) >= MAX_SHAPES:
            self._known.clear()
        self._known.add(shape)
