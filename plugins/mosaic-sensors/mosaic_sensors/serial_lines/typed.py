"""Gives handlers the message that a robot's file describes."""

from __future__ import annotations

import types
from typing import Any, TypeVar

from mosaic_core.contract.handler import Handler
from mosaic_core.contract.params import Message

H = TypeVar("H", bound=Handler)


def with_message(base: type[H], model: type[Message], way: Any) -> type[H]:
    """A subclass of ``base`` whose messages are of ``model``: the catalogue announces what the class says. ``way``:
    the generic handler that ``base`` derives from."""
    made: type[H] = types.new_class(
        base.__name__, (base, way[model]), exec_body=lambda body: body.update(__module__=base.__module__)
    )
    return made
