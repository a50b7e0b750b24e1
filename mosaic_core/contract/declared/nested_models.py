"""Finds models inside of models, and refuses those inside of ``params`` that would ignore a key they don't know."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeGuard, get_args

from pydantic import AliasChoices, BaseModel
from pydantic.fields import FieldInfo

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration


def check_nested(cls: type[BaseModel]) -> None:
    """Refuse a model, and a field whose model, ignores what is misspelt in the file."""
    if cls.model_config.get("extra", "ignore") == "ignore":
        message = 'its model_config has extra="ignore", with which a misspelt key is ignored.'
        raise wrong_declaration(cls, message, 'Leave `extra` out, or write "allow" and read what is left over.')
    for name, field in cls.model_fields.items():
        for model in models_in(field.annotation):
            if model.model_config.get("extra", "ignore") == "ignore":
                message = f"its field '{name}' is a {model.__name__}, which ignores a misspelt key."
                raise wrong_declaration(cls, message, f"Derive {model.__name__} from Params.")


def is_model(annotation: object) -> TypeGuard[type[BaseModel]]:
    """Whether it is the class of a model, and nothing else that may stand in an annotation."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models that a value of this type may be, or have inside."""
    if is_model(annotation):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)


def models_at(annotation: Any, loc: tuple[int | str, ...]) -> list[type[BaseModel]]:
    """Follow ``loc``, where pydantic says that something is, through fields, lists and unions; parts that name no field
    stay where they are."""
    here = [*models_in(annotation)]
    for part in loc:
        deeper = [
            inner
            for one in here
            for name, info in one.model_fields.items()
            if part in field_names(name, info)
            for inner in models_in(info.annotation)
        ]
        here = deeper or here
    return here


def keeps_unknown(annotation: Any, loc: tuple[int | str, ...]) -> bool:
    """Whether the model at ``loc`` keeps keys that it does not know, as its author wrote."""
    return any(one.model_config.get("extra") == "allow" for one in models_at(annotation, loc))


def field_names(name: str, field: FieldInfo) -> list[str]:
    """What a field is called where a message is read: by name and by alias."""
    alias = field.validation_alias
    choices = alias.choices if isinstance(alias, AliasChoices) else [alias]
    return [name, *(one for one in choices if isinstance(one, str))]


def names_of(model: type[BaseModel]) -> Iterator[str]:
    """What the fields of a model are called where it is read."""
    for name, field in model.model_fields.items():
        yield from field_names(name, field)
