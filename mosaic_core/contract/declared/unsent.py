"""Tells what an author's message says that nobody would get: keywords that are no field, and numbers that JSON does not
know."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from mosaic_core.contract.declared.code_lines import caller
from mosaic_core.contract.declared.nested_models import names_of
from mosaic_core.words.errors import MosaicError, hint_at


def unknown_field(model: type[BaseModel], data: Mapping[str, Any]) -> MosaicError | None:
    """The error for the first keyword that is no field of ``model``."""
    known = list(dict.fromkeys(names_of(model)))
    unknown = next((name for name in data if name not in known), None)
    if unknown is None:
        return None
    message = f"{caller().heading}{model.__name__} has no field '{unknown}'{hint_at(unknown, known)}"
    cure = f"It has: {', '.join(known)}. Whatever else a device says is left out by {model.__name__}.model_validate(…)."
    return MosaicError(f"{message} {cure}", code="plugin.wrong_message", cure=cure)


def with_its_nans(model: type[BaseModel], data: dict[str, Any], error: ValidationError) -> dict[str, Any]:
    """``data`` with a float for each number that is not finite and must not be absent, and ``None`` for what may be;
    raises ``error`` if it tells of anything else."""
    mistakes = error.errors(include_url=False, include_context=False)
    if not all(_is_not_finite(one["input"]) for one in mistakes):
        raise error
    for one in mistakes:
        data = _with_float(data, one["loc"])
    return {key: None if _is_absent(model, key, value) else value for key, value in data.items()}


def may_be_none(field: FieldInfo | None) -> bool:
    """Whether the message may be without it."""
    return field is not None and type(None) in get_args(field.annotation)


def _is_absent(model: type[BaseModel], key: str, value: Any) -> bool:
    return isinstance(value, float) and not math.isfinite(value) and may_be_none(model.model_fields.get(key))


def _is_not_finite(value: Any) -> bool:
    """Also of a text, and of a number of another library."""
    try:
        return not math.isfinite(float(value))
    except (TypeError, ValueError, OverflowError):
        return False


def _with_float(value: Any, loc: tuple[int | str, ...]) -> Any:
    """A copy of ``value`` with the float that is at ``loc``, or NaN in place of what around it can't be copied."""
    if not loc:
        return float(value)
    value = value.tolist() if hasattr(value, "tolist") else value  # an array of another library
    if isinstance(value, Mapping) and loc[0] in value:
        return {**value, loc[0]: _with_float(value[loc[0]], loc[1:])}
    if isinstance(value, list | tuple) and isinstance(loc[0], int):
        items = (_with_float(one, loc[1:]) if index == loc[0] else one for index, one in enumerate(value))
        return tuple(items) if isinstance(value, tuple) else [*items]
    return math.nan
