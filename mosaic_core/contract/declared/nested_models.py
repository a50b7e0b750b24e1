"""Refuses models inside of ``params`` that would ignore a key which they don't know."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration


def check_nested(cls: type[BaseModel]) -> None:
    """Refuse a field whose model ignores what is misspelt in the file."""
    for name, field in cls.model_fields.items():
        for model in _models_in(field.annotation):
            if model.model_config.get("extra", "ignore") == "ignore":
                message = f"its field '{name}' is a {model.__name__}, which ignores a misspelt key."
                raise wrong_declaration(cls, message, f"Derive {model.__name__} from Params.")


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)
