"""Checks what a handler sends against the type that its class declares."""

from __future__ import annotations

import inspect
import logging
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import BaseModel, PydanticUserError, ValidationError

from mosaic_core.machines.delivery.finite_message import finite
from mosaic_core.machines.delivery.message_shapes import MessageShapes, shape_of
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.wire_model import to_json

logger = logging.getLogger(__name__)

JsonMessage: TypeAlias = "BaseModel | Mapping[str, Any] | list[Any]"
_BYTES = (bytes, bytearray, memoryview)
_JSON = (dict, list, tuple, BaseModel, Mapping)
_CONTRACT = str(Path(__file__).parent)
MAX_TOLD = 64
"""Fields of one class that the log names; keys of mappings may be without number."""


class DeclaredMessage:
    """The type of the messages that one class of handlers sends. Any thread."""

    def __init__(self, handler: type, declared: Any) -> None:
        self._handler = handler
        self._declared = declared
        self._model: type[BaseModel] | None = declared if _is_model(declared) else None
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
        nulled, _ = finite(_plain(value), self._schema)
        try:
            model.model_validate(nulled)
        except ValidationError as error:
            mistakes = error.errors(include_url=False, include_input=False, include_context=False)[:4]
            fields = (f"{'.'.join(map(str, one['loc'])) or 'message'}: {one['msg']}" for one in mistakes)
            raise self._wrong(value, "; ".join(fields)) from None

    def json_of(self, value: JsonMessage, label: str) -> str | None:
        """JSON text, with null for numbers that are not finite where the class declares that they may be absent.
        ``None``, and a line in the log, once for each field: it must not be sent."""
        plain = _plain(value)
        try:
            return to_json(plain)
        except ValueError:
            nulled, refused = finite(plain, self._schema)
        for field in refused:
            if (label, field) not in self._told and len(self._told) < MAX_TOLD:
                self._told.add((label, field))
                text = "connector %r: %s of a message is no finite number, and not declared as `float | None`: refused"
                logger.warning(text, label, field, extra={"label": label})
        return None if refused else to_json(nulled)

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
        message = f"{self._handler.__qualname__}{self._place} declares {name} and sends {what}{detail}"
        return MosaicError(message, code="plugin.wrong_message")

    @property
    def _place(self) -> str:
        """Where the body is written, else the class."""
        body = getattr(self._handler, "messages", None)
        code = getattr(body, "__code__", None)
        if code is not None and not code.co_filename.startswith(_CONTRACT):
            return f" ({code.co_filename}:{code.co_firstlineno})"
        try:
            return f" ({inspect.getsourcefile(self._handler)}:{inspect.getsourcelines(self._handler)[1]})"
        except (OSError, TypeError):
            return ""


def _plain(value: JsonMessage) -> Any:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else value


def _is_model(declared: Any) -> bool:
    return isinstance(declared, type) and issubclass(declared, BaseModel)
