"""Refuses defaults of ``Params`` and messages that their own fields would not take: pydantic takes a default unseen."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import ErrorDetails

from mosaic_core.contract.declared.expectations import EXPLAINED, expectation
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.words.errors import slip_of

_FIELD_WORDS = frozenset({*inspect.signature(Field).parameters, "unit"})
_NOTHING = object()
"""In place of a value that is not looked at."""


def check_defaults(cls: type[BaseModel], context: Any = None) -> None:
    """Refuse a plain default that is of another kind than its field, or beyond its bounds. What a ``default_factory``
    makes is not asked for, and a validator of the author's own may be meant for what somebody writes."""
    _check_field_words(cls)
    fields = cls.model_fields.items()
    written = {name: its.default for name, its in fields if not its.is_required() and its.default_factory is None}
    for mistake in _mistakes(cls, written, context):
        name = str(mistake["loc"][0])
        expected, meant = expectation(mistake, name)
        message = f"the default of its field '{name}' is {written[name]!r}; {expected}."
        cure = f"Correct the default of '{name}', or the type of the field."
        raise wrong_declaration(cls, message, f"{meant} {cure}" if meant else cure)


def _check_field_words(cls: type[BaseModel]) -> None:
    """Refuse a misspelt word of ``Field``: pydantic keeps it for the schema, and nothing reads it; and what is no
    mapping where its unit belongs."""
    for name, field in cls.model_fields.items():
        _check_extra(cls, name, field.json_schema_extra)
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        for word in extra.keys() - _FIELD_WORDS:
            if meant := slip_of(word, _FIELD_WORDS):
                message = f"Field of '{name}' has '{word}', which nothing reads; did you mean '{meant}'?"
                raise wrong_declaration(cls, message, f"Write {meant}.")


def _check_extra(cls: type[BaseModel], name: str, extra: Any) -> None:
    said = "unit" if getattr(extra, "__name__", "") == "unit" else repr(extra)
    if said == "unit" or not (extra is None or isinstance(extra, dict) or callable(extra)):
        unit = extra if isinstance(extra, str) else "V"
        message = f"Field of '{name}' has json_schema_extra={said}, which nothing reads."
        raise wrong_declaration(cls, message, f'Write json_schema_extra=unit("{unit}").')


def _mistakes(cls: type[BaseModel], written: dict[str, Any], context: Any) -> Iterator[ErrorDetails]:
    """First what no reading makes a value of the field; then texts and mappings that only reading would make one."""
    yield from _errors(cls, written, context)
    unread = {name: default for name, default in written.items() if isinstance(default, str | dict)}
    yield from _errors(cls, unread, context, strict=True)


def _errors(cls: type[BaseModel], values: dict[str, Any], context: Any, *, strict: bool = False) -> list[ErrorDetails]:
    """What the fields say against their ``values``. Each other field has one too, so that no factory is run."""
    if not values:
        return []
    every = {**dict.fromkeys(cls.model_fields, _NOTHING), **values}
    try:
        cls.__pydantic_validator__.validate_python(every, strict=strict, context=context, by_name=True, by_alias=False)
    except ValidationError as error:
        found = error.errors(include_url=False)
        return [one for one in found if {*one["loc"][:1]} & values.keys() and one["type"] not in EXPLAINED]
    except Exception:  # noqa: BLE001 - a validator of the author's own may want more than the defaults
        return []
    return []
