"""Checks what a handler sends against the type that its class declares."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import BaseModel, PydanticUserError, ValidationError
from pydantic_core import ErrorDetails, PydanticSerializationError

from mosaic_core.contract.declared.code_lines import caller, code_of
from mosaic_core.contract.declared.json_values import encoded, odd_part
from mosaic_core.contract.declared.nested_models import is_model, names_of
from mosaic_core.contract.declared.wrong_declaration import wrong_message
from mosaic_core.machines.delivery.finite_message import finite
from mosaic_core.machines.delivery.message_shapes import MessageShapes, shape_of
from mosaic_core.words.errors import CodeLine, MosaicError, slip_of
from mosaic_core.words.wire_model import to_json

logger = logging.getLogger(__name__)

JsonMessage: TypeAlias = "BaseModel | Mapping[str, Any] | list[Any]"
_BYTES = (bytes, bytearray, memoryview)
_JSON = (dict, list, tuple, BaseModel, Mapping)
_CONTRACT = str(Path(__file__).parents[1])
_SPELT_OTHERWISE = frozenset(
    f"{one}_type" for one in ("tuple", "set", "frozen_set", "bytes", "datetime", "date", "time", "time_delta")
)
"""What JSON has as a list or as text, and a strict look at it, behind a validator of its model, takes for wrong."""
MAX_TOLD = 64
"""Fields of one class that the log names; keys of mappings may be without number."""


class DeclaredMessage:
    """The type of the messages that one class of handlers sends. Any thread."""

    def __init__(self, handler: type, declared: Any) -> None:
        self._handler = handler
        self._declared = declared
        self._model: type[BaseModel] | None = declared if is_model(declared) else None
        self._taken: Any = self._model or (_BYTES if declared is bytes else str if declared is str else _JSON)
        self._shapes = MessageShapes()
        self._told: set[tuple[str, str]] = set()

    def check(self, value: Any) -> None:
        """Raise :class:`MosaicError` (``plugin.wrong_message``) if ``value`` is not what the class declares."""
        shape = shape_of(value)
        if not self._shapes.is_known(shape):
            self._check_new(value)
            self._shapes.add(shape)

    def _check_new(self, value: Any) -> None:
        if isinstance(value, self._taken):
            return
        if self._model is None or not isinstance(value, BaseModel | Mapping):
            raise self._wrong(value, "")
        self._check_shape(value, self._model)

    def _check_shape(self, value: BaseModel | Mapping[str, Any], model: type[BaseModel]) -> None:
        nulled, _ = finite(_plain(value)[0], self._schema)
        self._check_keys(value, nulled, [*names_of(model)])
        self._validate(value, nulled, model)

    def _check_keys(self, value: Any, plain: Mapping[str, Any], known: list[str]) -> None:
        """A key that is almost a field was meant to be it; others are for who knows more."""
        slips = {key: slip_of(key, (name for name in known if name not in plain)) for key in plain if key not in known}
        told = [f"no field '{key}': did you mean '{meant}'?" for key, meant in slips.items() if meant]
        if told or len(slips) == len(plain) > 0:
            raise self._wrong(value, told[0] if told else "none of its fields")

    def _validate(self, value: Any, plain: Any, model: type[BaseModel]) -> None:
        """Of what goes out: a number as text would stay text."""
        text = to_json(plain)
        mistakes = _mistakes(model, text, strict=True)
        if mistakes and all(one["type"] in _SPELT_OTHERWISE for one in mistakes):
            mistakes = _mistakes(model, text, strict=False)
        told = [one for one in mistakes if one["type"] not in _SPELT_OTHERWISE] or mistakes
        if told:
            fields = (f"{'.'.join(map(str, one['loc'])) or 'message'}: {one['msg']}" for one in told[:4])
            raise self._wrong(value, "; ".join(fields))

    def json_of(self, value: JsonMessage, label: str) -> bytes | None:
        """JSON, with null for numbers that are not finite where the class declares that they may be absent. ``None``,
        and a line in the log, once for each field: it must not be sent."""
        plain, is_sound = _plain(value)
        if is_sound:
            try:
                return encoded(plain)
            except ValueError:  # a number that JSON does not know
                pass
            except TypeError as error:
                raise self._sends(str(error)) from None
        refused = self.unsent(value)
        self._tell(label, refused)
        if refused:
            return None
        nulled, _ = finite(plain, self._schema)
        if isinstance(value, BaseModel):
            self._validate(value, nulled, type(value))
        return encoded(nulled)

    def text_of(self, text: str) -> bytes:
        """The bytes of a text; raises :class:`MosaicError` (``plugin.wrong_message``) for half of a character."""
        try:
            return text.encode()
        except UnicodeEncodeError:
            raise self._sends(odd_part(text)) from None

    def _sends(self, odd: str) -> MosaicError:
        return wrong_message(self._handler.__qualname__, self._at, f"sends {odd}", odd.rpartition(": ")[2])

    def unsent(self, value: JsonMessage) -> tuple[str, ...]:
        """The fields because of which it must not be sent: they are no finite number, and may not be absent."""
        numbers = value.model_dump(warnings=False) if isinstance(value, BaseModel) else value
        return finite(numbers, self._schema)[1]

    def told_of(self, field: str) -> str:
        """What is wrong with such a field, with class and line."""
        why = "which is no finite number and not declared as `float | None`"
        return f"{self._handler.__qualname__}{self._at.in_brackets} sends {field!r}, {why}"

    def _tell(self, label: str, refused: tuple[str, ...]) -> None:
        for field in refused:
            if (label, field) not in self._told and len(self._told) < MAX_TOLD:
                self._told.add((label, field))
                fields = {"label": label, "code": "plugin.wrong_message"}
                text = "connector %r: %s: refused (plugin.wrong_message)"
                logger.warning(text, label, self.told_of(field), extra=fields)

    @cached_property
    def _schema(self) -> dict[str, Any] | None:
        try:
            return self._model.model_json_schema(mode="serialization") if self._model is not None else None
        except PydanticUserError:
            return None

    def _wrong(self, value: Any, fields: str) -> MosaicError:
        name = getattr(self._declared, "__name__", str(self._declared))
        what = f"keys {', '.join(map(str, list(value)[:8]))}" if isinstance(value, Mapping) else type(value).__name__
        detail = f" ({fields})" if fields else ""
        return wrong_message(self._handler.__qualname__, self._at, f"declares {name} and sends {what}{detail}")

    @property
    def _at(self) -> CodeLine:
        """Where it is sent, else where the body is written, else the class."""
        sent = caller()
        if sent.file:
            return sent
        body = code_of(getattr(self._handler, "messages", None))
        return body if body.file and not body.file.startswith(_CONTRACT) else code_of(self._handler)


def _plain(value: JsonMessage) -> tuple[Any, bool]:
    """JSON-ready values, and whether each is of the type that its class says: an attribute may be set to anything."""
    if not isinstance(value, BaseModel):
        return value, True
    try:
        return value.model_dump(mode="json", warnings="error"), True
    except PydanticSerializationError:
        return value.model_dump(mode="json", warnings=False), False


def _mistakes(model: type[BaseModel], text: str, *, strict: bool) -> list[ErrorDetails]:
    try:
        model.model_validate_json(text, strict=strict, by_alias=True, by_name=True)
    except ValidationError as error:
        return error.errors(include_url=False, include_input=False, include_context=False)
    return []
