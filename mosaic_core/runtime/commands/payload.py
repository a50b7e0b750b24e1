"""Parses the bytes of one message into the ``T`` of its receiver; what does not fit is refused with a reason."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from pydantic import PydanticUserError, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from mosaic_core.contract.declared.nested_models import is_model, keeps_unknown, names_of
from mosaic_core.contract.handler import DataChannelReceivable, Refused, message_type_of
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.runtime.configuration.config_problems import known_keys
from mosaic_core.words.errors import nearest

MAX_KEY = 40
"""Characters of a stranger's key that a refusal repeats."""
MAX_LETTERS = 300
"""Characters of what is wrong in one refusal."""
_NO_OBJECT = ("model_type", "model_attributes_type", "dict_type")
"""Pydantic's words for what is no mapping of keys to values."""


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise Refused("safety.not_finite", f"{text[:20]} is not a finite number")
    return value


def _not_finite(text: str) -> float:
    raise Refused("safety.not_finite", f"{text} is not a finite number")


class PayloadReader:
    """Reads the payloads of one receiver. What a command says beside its fields is for who knows more, and ignored; of
    a question it is misspelt, and the answer would be to another one: it is refused."""

    def __init__(self, handler: DataChannelReceivable[Any]) -> None:
        self._type = message_type_of(type(handler))
        is_plain = self._type in (str, bytes)
        self._adapter: TypeAdapter[Any] | None = None if is_plain else TypeAdapter(self._type)
        self._is_strict = isinstance(handler, RequestHandler)

    def read(self, payload: bytes) -> Any:
        """The value; raises :class:`Refused` with ``channel.invalid`` or ``safety.not_finite``."""
        return self.validated(self.parsed(payload))

    def parsed(self, payload: bytes) -> Any:
        """What the JSON says, before it is known to be a ``T``; text and bytes are what they are."""
        if self._type is bytes:
            return payload
        try:
            text = payload.decode()
        except UnicodeDecodeError:
            raise Refused("channel.invalid", "not UTF-8 text") from None
        if self._adapter is None:
            return text
        try:
            value = json.loads(text, parse_float=_finite, parse_constant=_not_finite)
            if "\\u" in text:
                _check_unicode(value)
        except (ValueError, RecursionError) as error:
            raise Refused("channel.invalid", _unread(error)) from None
        return value

    def schema(self) -> dict[str, Any]:
        """The JSON Schema of what it reads; empty for text, bytes and types that have none."""
        if self._adapter is None:
            return {}
        try:
            return self._adapter.json_schema()
        except PydanticUserError:
            return {}

    def validated(self, value: Any) -> Any:
        """``value`` as a ``T``."""
        if self._adapter is None:
            return value
        try:
            return self._adapter.validate_python(value, extra="forbid" if self._is_strict else None)
        except ValidationError as error:
            mistakes = error.errors(include_url=False, include_input=False, include_context=False)
        extra = [one["loc"] for one in mistakes if one["type"] == "extra_forbidden"]
        unknown = [loc for loc in extra if not keeps_unknown(self._type, loc[:-1])]
        others = [one for one in mistakes if one["type"] != "extra_forbidden"]
        if not unknown and len(others) < len(mistakes):  # what one of its models keeps
            with suppress(ValidationError):
                return self._adapter.validate_python(value)
        words = [
            self._no_object(others) or _in_words(others),
            self._no_field(unknown[0]) if unknown else self._unknown_beside(others, value),
        ]
        raise Refused("channel.invalid", "; ".join(filter(None, words)))

    def _no_object(self, mistakes: list[ErrorDetails]) -> str:
        """Where the whole of it is no JSON object."""
        if not any(one["type"] in _NO_OBJECT and not one["loc"] for one in mistakes):
            return ""
        fields = ", ".join(dict.fromkeys(names_of(self._type))) if is_model(self._type) else ""
        return "a JSON object is wanted" + (f", with the fields {fields}"[:MAX_LETTERS] if fields else "")

    def _no_field(self, loc: tuple[int | str, ...]) -> str:
        return _without_field(str(loc[-1]), known_keys(self._type, loc[:-1]))

    def _unknown_beside(self, mistakes: list[ErrorDetails], value: Any) -> str:
        """The first key that is no field, where a field is missing: it was probably meant to be that one."""
        missing = [str(one["loc"][0]) for one in mistakes if one["type"] == "missing" and len(one["loc"]) == 1]
        if not missing or not is_model(self._type) or not isinstance(value, dict):
            return ""
        known = {*names_of(self._type)}
        unknown = next((key for key in value if key not in known), None)
        return _without_field(unknown, missing) if unknown is not None else ""


def _without_field(key: str, known: Iterable[str]) -> str:
    meant = nearest(key[:MAX_KEY], known)
    return f"no field {key[:MAX_KEY]!r}" + (f": did you mean '{meant}'?" if meant else "")


def _unread(error: ValueError | RecursionError) -> str:
    """What is wrong with a text that is not taken as JSON."""
    if isinstance(error, RecursionError):
        return "nested too deeply"
    if isinstance(error, UnicodeError):
        return "half a surrogate pair"
    return "not JSON" if isinstance(error, json.JSONDecodeError) else "a whole number of too many digits"


def _check_unicode(value: Any) -> None:
    """Half a surrogate pair can be written in JSON but not in UTF-8: whoever prints or forwards it would break."""
    json.dumps(value, ensure_ascii=False).encode()


def _in_words(mistakes: list[ErrorDetails]) -> str:
    """At most three mistakes, without quoting the input back."""
    parts = [f"{'.'.join(map(str, item['loc'])) or 'message'}: {item['msg']}" for item in mistakes[:3]]
    return "; ".join(parts)[:MAX_LETTERS]
