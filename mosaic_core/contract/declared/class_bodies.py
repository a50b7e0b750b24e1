"""Refuses bodies that the framework can't call, or would call in vain."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration


@dataclass(frozen=True, slots=True)
class BodyForm:
    """How a body is written. ``arguments``: what it is called with, one row for each way."""

    arguments: tuple[tuple[str, ...], ...]
    yields: bool = False
    may_be_async: bool = False


FORMS = {
    "messages": BodyForm(((),), yields=True, may_be_async=True),
    "frames": BodyForm(((),), yields=True, may_be_async=True),
    "sounds": BodyForm(((),), yields=True, may_be_async=True),
    "handle_data": BodyForm((("data",), ("data", "sender")), may_be_async=True),
    "answer": BodyForm((("question", "request"),), may_be_async=True),
    "make_safe": BodyForm((("cause",),)),
    "reported_position": BodyForm((("field",),)),
    "peer_left": BodyForm((("sender",),)),
    "handle_sound": BodyForm((("sound", "sender"),)),
    "talk_ended": BodyForm(((),)),
    "configure": BodyForm(((),)),
}


def check_bodies(cls: type) -> None:
    """Refuse a body of another form than it is called in."""
    for name, form in FORMS.items():
        written = vars(cls).get(name)
        if inspect.isfunction(written) and any(hasattr(base, name) for base in cls.__mro__[1:]):
            _check_kind(cls, name, form, written)
            _check_arguments(cls, name, form, written)


def _check_kind(cls: type, name: str, form: BodyForm, written: Callable[..., Any]) -> None:
    head = f"def {name}({', '.join(('self', *form.arguments[0]))})"
    if form.yields:
        if inspect.iscoroutinefunction(written):
            message = f"{name} is an `async def` without a `yield`, and nothing of it would be sent."
            raise wrong_declaration(cls, message, f"Let it yield what it sends, or write `{head}` that does.")
        return
    is_generator = inspect.isgeneratorfunction(written) or inspect.isasyncgenfunction(written)
    if is_generator or (inspect.iscoroutinefunction(written) and not form.may_be_async):
        what = "yields" if is_generator and form.may_be_async else "is async or yields"
        message = f"{name} {what}, and nothing of it would run."
        raise wrong_declaration(cls, message, f"Write it as a plain `{head}`.")


def _check_arguments(cls: type, name: str, form: BodyForm, written: Callable[..., Any]) -> None:
    wrong = [_refusal(written, arguments) for arguments in form.arguments]
    if None not in wrong:
        heads = " or ".join(f"`def {name}({', '.join(('self', *one))})`" for one in form.arguments)
        message = f"{name} can't be called with ({', '.join(form.arguments[0])}): {wrong[0]}."
        raise wrong_declaration(cls, message, f"Write {heads}.")


def _refusal(written: Callable[..., Any], arguments: tuple[str, ...]) -> str | None:
    try:
        inspect.signature(written).bind(None, *arguments)
    except TypeError as error:
        return str(error)
    return None
