"""Tells who gives a function of the kit something else than it tests which function is meant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from pydantic import BaseModel

from mosaic_core.contract.handler import Handler

_TESTED_BY = {
    "messages": "collect",
    "frames": "take_frames",
    "sounds": "take_sounds",
    "answer": "ask",
    "handle_data": "feed",
}
"""By the body of a handler; who answers also takes messages."""


def check_has(handler: object, body: str) -> None:
    """Raise :class:`TypeError` where ``handler`` is none with this body."""
    if isinstance(handler, Handler) and hasattr(handler, body):
        return
    function = _TESTED_BY[body]
    if isinstance(handler, Sequence):
        names = ", ".join(type(one).__name__ for one in handler)
        index = next((index for index, one in enumerate(handler) if hasattr(one, body)), None)
        cure = f": write `build(…)[{index}]`" if index is not None else f", and none of them has `{body}`"
        raise TypeError(f"`{function}` tests one handler, and `configure()` made several ({names}){cure}")
    if isinstance(handler, type):
        raise TypeError(f"`{function}` tests a handler, not a class: write `build(…)` of its configurer")
    name = type(handler).__name__
    meant = next((function for own, function in _TESTED_BY.items() if hasattr(handler, own)), None)
    cure = f": it is tested by `{meant}`" if isinstance(handler, Handler) and meant is not None else ""
    raise TypeError(f"`{function}` tests a handler that has `{body}`, and {name} has none{cure}")


def check_handler(handler: object, function: str) -> None:
    """Raise :class:`TypeError` where ``handler`` is none."""
    if isinstance(handler, Handler):
        return
    if isinstance(handler, type):
        raise TypeError(f"`{function}` takes a handler, not a class: write `build(…)` of its configurer")
    cure = ": write `build(…)[0]` for the first of several" if isinstance(handler, list | tuple) else ""
    raise TypeError(f"`{function}` takes a handler, not a {type(handler).__name__}{cure}")


def check_made(name: str, given: object, kind: type) -> None:
    """Raise :class:`TypeError` where the argument ``name`` is neither left out nor of this ``kind``."""
    if given is None or isinstance(given, kind):
        return
    what = f"the class {given.__name__}" if isinstance(given, type) else repr(given)
    raise TypeError(f"`{name}` is a {kind.__name__}, and not {what}: write `{name}={kind.__name__}()`")


def check_script(script: object) -> None:
    """Raise :class:`TypeError` for one message or step alone, whose parts would be fed."""
    if isinstance(script, type):
        raise TypeError(f"a script is a list of messages and steps, not a class: write `[{script.__name__}(…)]`")
    if isinstance(script, Mapping | BaseModel | str | bytes) or not isinstance(script, Iterable):
        raise TypeError(
            f"a script is a list of messages and steps, not a {type(script).__name__}: write `[…]` around it"
        )


def check_step(step: object) -> None:
    """Raise :class:`TypeError` for what would be sent as a message and is none: a step whose brackets were forgotten,
    a pause that is none, the outcome of what returns nothing."""
    if isinstance(step, type):
        raise TypeError(f"a step is made with brackets: write `{step.__name__}(…)`")
    if step is None or isinstance(step, int | float):
        cure = "" if step is None or isinstance(step, bool) else f": write `Silence({step})` for a pause"
        raise TypeError(f"a script is made of messages and steps, and {step!r} is neither{cure}")
