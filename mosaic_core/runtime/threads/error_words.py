"""Says what an error of a plugin's code says, in words that name the cure: the nearest name, what was expected."""

from __future__ import annotations

from collections.abc import Iterable
from traceback import walk_tb

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from mosaic_core.contract.declared.expectations import EXPLAINED, expectation
from mosaic_core.contract.declared.nested_models import names_of
from mosaic_core.runtime.threads.import_words import import_meant
from mosaic_core.words.errors import DeviceGone, Refused, guess, nearest

MANY_MISTAKES = 4
"""More of one model are no help in an error."""
MANY_LETTERS = 60
"""As many of a refused value are shown."""


def meant_by(error: BaseException) -> BaseException:
    """The error that a group of errors stands for, as a task group raises it: its only one, or the first of absences
    and refusals alone; any other error, and any other group, is what it is."""
    while isinstance(error, BaseExceptionGroup):
        parts = [meant_by(one) for one in error.exceptions]
        is_same = len(parts) == 1 or any(all(isinstance(one, kind) for one in parts) for kind in (DeviceGone, Refused))
        if not is_same:
            return error
        error = parts[0]
    return error


def said_by(error: BaseException) -> str:
    """Kind and words of an error; of an attribute or a name to import that is not there also the nearest that is."""
    if speechless := _speechless(error):
        return f"{type(error).__name__}: {speechless}"
    if isinstance(error, BaseExceptionGroup):
        return "; ".join(said_by(one) for one in error.exceptions[:MANY_MISTAKES])
    meant = _attribute_meant(error) or import_meant(error)
    said = (
        error.msg if isinstance(error, SyntaxError) else _refused_values(error) or error
    )  # the place is told by itself
    return f"{type(error).__name__}: {said}{meant}"


def words_of(error: BaseException) -> str:
    """Its own words; what keeps it from speaking where its class can't make them."""
    return _speechless(error) or str(error)


def _speechless(error: BaseException) -> str:
    try:
        str(error)
    except Exception as raised:  # noqa: BLE001 - the code of a plugin, which may fail in any way
        return f"it can't say what happened, for its __str__ raises {type(raised).__name__}"
    return ""


def _attribute_meant(error: BaseException) -> str:
    if not isinstance(error, AttributeError) or not isinstance(error.name, str):
        return ""
    names = object.__dir__(error.obj)  # without the plugin's own code
    meant = nearest(error.name, (one for one in names if error.name.startswith("_") or not one.startswith("_")))
    return f"; did you mean '{meant}'?" if meant else ""


def _refused_values(error: BaseException) -> str:
    """What a model refused, by field; nothing of any other error."""
    if not isinstance(error, ValidationError):
        return ""
    model = _model_of(error)
    told = [_refused_value(one, model) for one in error.errors(include_url=False)[:MANY_MISTAKES]]
    return f"{error.title}: {'; '.join(told)}"


def _refused_value(mistake: ErrorDetails, model: type[BaseModel] | None) -> str:
    field = ".".join(map(str, mistake["loc"]))
    if mistake["type"] == "missing":
        return f"'{field}' is missing"
    if mistake["type"] == "extra_forbidden":
        return f"unknown key '{field}'" + _in_brackets(guess(field, _names_in(model)))
    expected, cure = expectation(mistake, str(mistake["loc"][-1]) if mistake["loc"] else "")
    got = "" if mistake["type"] in EXPLAINED else f", got {mistake['input']!r:.{MANY_LETTERS}}"
    return f"{field}{': ' if field else ''}{expected}{got}{_in_brackets(cure)}"


def _in_brackets(cure: str) -> str:
    return f" ({cure})" if cure else ""


def _names_in(model: type[BaseModel] | None) -> Iterable[str]:
    return () if model is None else names_of(model)


def _model_of(error: ValidationError) -> type[BaseModel] | None:
    """The class whose values were refused: pydantic tells its name alone."""
    for frame, _ in walk_tb(error.__traceback__):
        one = frame.f_locals.get("self", frame.f_locals.get("cls"))
        kind = one if isinstance(one, type) else type(one)
        if issubclass(kind, BaseModel) and kind.__name__ == error.title:
            return kind
    return None
