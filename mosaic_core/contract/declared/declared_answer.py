"""Checks what a request handler answers against the type that its class declares."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails, PydanticSerializationError

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.declared.json_values import encoded, odd_part
from mosaic_core.contract.declared.nested_models import keeps_unknown, models_at, names_of
from mosaic_core.contract.declared.wrong_declaration import wrong_message
from mosaic_core.contract.declared.yielded import kind_of
from mosaic_core.machines.delivery.finite_message import finite
from mosaic_core.words.errors import MosaicError, nearest

MANY_MISTAKES = 4
"""As many mistakes of one answer are told."""


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
            valid = self._validated(answer)
            adapter = TypeAdapter(type(valid)) if isinstance(valid, BaseModel) else self._adapter  # of one of its kind
            plain = adapter.dump_python(valid, mode="json", warnings="error")
        except PydanticSerializationError as error:
            said = str(error).partition("PydanticSerializationUnexpectedValue(")[2].rstrip(") \n")
            said = said or odd_part(answer) or str(error)
            raise self._wrong(f"answers what {self._name} does not declare: {said}") from None
        try:
            encoded(plain)
        except TypeError as error:
            raise self._wrong(f"answers {error}") from None
        except ValueError:
            plain, refused = finite(plain, self._adapter.json_schema(mode="serialization"))
            if refused:
                fields = ", ".join(map(repr, refused))
                why = "which is no finite number and not declared as `float | None`"
                raise self._wrong(f"answers {fields}, {why}") from None
        return plain

    def _validated(self, answer: Any) -> Any:
        """``answer`` as its type. A key that it does not have is refused: it was misspelt, and would be lost."""
        try:
            return self._adapter.validate_python(answer, extra="forbid")
        except ValidationError as error:
            mistakes = error.errors(include_url=False, include_input=False, include_context=False)
        told = [words for one in mistakes if (words := self._told(one))]
        if not told:  # what one of its models keeps
            return self._adapter.validate_python(answer)
        raise self._wrong(f"declares {self._name} and answers {kind_of(answer)} ({'; '.join(told[:MANY_MISTAKES])})")

    def _told(self, mistake: ErrorDetails) -> str:
        loc = mistake["loc"]
        field = ".".join(map(str, loc)) or "answer"
        if mistake["type"] != "extra_forbidden":
            return f"{field}: {mistake['msg']}"
        if keeps_unknown(self._declared, loc[:-1]):
            return ""
        known = (name for one in models_at(self._declared, loc[:-1]) for name in names_of(one))
        meant = nearest(str(loc[-1]), known)
        return f"no field '{field}'" + (f": did you mean '{meant}'?" if meant else "")

    @property
    def _name(self) -> str:
        return getattr(self._declared, "__name__", str(self._declared))

    def _wrong(self, what: str) -> MosaicError:
        at = code_of(getattr(self._handler, "answer", None))
        return wrong_message(f"{self._handler.__qualname__}.answer", at, what)
