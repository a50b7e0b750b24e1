"""Refuses bodies that the framework can't call, or would call in vain."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
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
        if name in vars(cls) and any(hasattr(base, name) for base in cls.__mro__[1:]):
            _check_body(cls, name, form, vars(cls)[name])


def _check_body(cls: type, name: str, form: BodyForm, written: Any) -> None:
    """A function, or anything else that can be called as if it were one."""
    if isinstance(written, property | cached_property) or not (callable(written) or hasattr(written, "__get__")):
        what = f"is a {type(written).__name__}" if written is not None else "is None"
        message = f"{name} {what}, and can't be called."
        lost = " A decorator has to return the function." if written is None else ""
        raise wrong_declaration(cls, message, f"Write it as a plain `{_head(name, form)}`.{lost}")
    function = written.__func__ if isinstance(written, staticmethod | classmethod) else written
    own = () if isinstance(written, staticmethod) or not hasattr(function, "__get__") else (None,)
    if inspect.isroutine(function):
        _check_kind(cls, name, form, function)
    if callable(function):
        _check_arguments(cls, name, form, function, own)


def _head(name: str, form: BodyForm) -> str:
    return f"def {name}({', '.join(('self', *form.arguments[0]))})"


def _check_kind(cls: type, name: str, form: BodyForm, written: Callable[..., Any]) -> None:
    head = _head(name, form)
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


def _check_arguments(cls: type, name: str, form: BodyForm, written: Callable[..., Any], own: tuple[Any, ...]) -> None:
    """``own``: what it is called with before its arguments, which is the handler where it is a method."""
    wrong = [_refusal(written, (*own, *arguments)) for arguments in form.arguments]
    if None not in wrong:
        heads = " or ".join(f"`def {name}({', '.join(('self', *one))})`" for one in form.arguments)
        message = f"{name} can't be called with ({', '.join(form.arguments[0])}): {wrong[0]}."
        raise wrong_declaration(cls, message, f"Write {heads}.")


def _refusal(written: Callable[..., Any], arguments: tuple[Any, ...]) -> str | None:
    try:
        inspect.signature(written).bind(*arguments)
    except TypeError as error:
        return str(error)
    except ValueError:  # a function of C says nothing of its arguments
        return None
    return None
