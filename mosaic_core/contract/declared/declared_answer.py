"""Checks what a request handler answers against the type that its class declares."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticSerializationError

from mosaic_core.contract.declared.yielded import kind_of
from mosaic_core.machines.delivery.finite_message import finite
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.wire_model import to_json


class DeclaredAnswer:
    """The type of the answers that one class of handlers gives. Any thread."""

    def __init__(self, handler: type, declared: Any) -> None:
        self._handler = handler
        self._declared = declared
        self._adapter: TypeAdapter[Any] = TypeAdapter(declared)

    def plain(self, answer: Any) -> Any:
        """``answer`` as JSON-ready values, with null for a number that is not finite and may be absent. Raises
        :class:`MosaicError` (``plugin.wrong_message``) for anything that the class does not declare."""
        try:
            # What a model holds unchecked, such as NaN in an `int`, would leave as null.
            plain = self._adapter.dump_python(self._adapter.validate_python(answer), mode="json", warnings="error")
        except PydanticSerializationError as error:
            said = str(error).partition("PydanticSerializationUnexpectedValue(")[2].rstrip(") \n")
            raise self._wrong(f"answers what {self._name} does not declare: {said}") from None
        except ValidationError as error:
            mistakes = error.errors(include_url=False, include_input=False, include_context=False)[:4]
            told = (f"{'.'.join(map(str, one['loc'])) or 'answer'}: {one['msg']}" for one in mistakes)
            raise self._wrong(f"declares {self._name} and answers {kind_of(answer)} ({'; '.join(told)})") from None
        try:
            to_json(plain)
        except ValueError:
            plain, refused = finite(plain, self._adapter.json_schema(mode="serialization"))
            if refused:
                fields = ", ".join(map(repr, refused))
                why = "which is no finite number and not declared as `float | None`"
                raise self._wrong(f"answers {fields}, {why}") from None
        return plain

    @property
    def _name(self) -> str:
        return getattr(self._declared, "__name__", str(self._declared))

    def _wrong(self, what: str) -> MosaicError:
        code = getattr(getattr(self._handler, "answer", None), "__code__", None)
        place = f" ({code.co_filename}:{code.co_firstlineno})" if code is not None else ""
        return MosaicError(f"{self._handler.__qualname__}.answer{place} {what}", code="plugin.wrong_message")
