"""Refuses what the class of a message says of itself and nobody would read: misspelt, of another kind, or of a field
that it does not have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.declared.nested_models import field_names, models_in, names_of
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.words.errors import hint_at, slip_of
from mosaic_core.words.limits import MOTION_KINDS

WORDS: Mapping[str, str] = {
    "schema_id": 'schema_id: ClassVar[str] = "acme/Grip@1"',
    "motion_kinds": 'motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"speed": "velocity"}',
    "keyed_by": 'keyed_by: ClassVar[Mapping[str, str]] = {"positions": "names"}',
}
"""What is read of the class of a message, and how it is written."""


def check_message_words(cls: type[BaseModel]) -> None:
    """Refuse words of the class that nothing reads, and motions that are none."""
    for name in cls.model_fields:
        if name in WORDS:
            raise wrong_declaration(cls, f"{name} is a field of it.", f"Say it of the class: {WORDS[name]}.")
    for name in cls.__class_vars__ & vars(cls).keys() - WORDS.keys():
        if meant := slip_of(name, WORDS):
            message = f"it has '{name}', which nothing reads; did you mean '{meant}'?"
            raise wrong_declaration(cls, message, f"Write {meant}, or begin a name of your own with _.")
    _check_kinds(cls, vars(cls).get("motion_kinds", {}))


def _check_kinds(cls: type[BaseModel], kinds: Any) -> None:
    if not isinstance(kinds, Mapping):
        raise wrong_declaration(cls, f"motion_kinds is {kinds!r}, and no mapping.", f"Write {WORDS['motion_kinds']}.")
    for path, kind in kinds.items():
        if kind not in MOTION_KINDS:
            message = f"motion_kinds says that '{path}' is a {kind!r}."
            raise wrong_declaration(cls, message, f"Write one of: {', '.join(MOTION_KINDS)}.")
        _check_path(cls, cls, path, path.split("."))


def _check_path(cls: type[BaseModel], model: type[BaseModel], path: str, names: list[str]) -> None:
    found = [field for name, field in model.model_fields.items() if names[0] in field_names(name, field)]
    if not found:
        known = [*dict.fromkeys(names_of(model))]
        message = (
            f"motion_kinds names '{path}', and {model.__name__} has no field '{names[0]}'{hint_at(names[0], known)}"
        )
        raise wrong_declaration(cls, message, f"It has: {', '.join(known)}.")
    for inner in models_in(found[0].annotation) if names[1:] else ():
        _check_path(cls, inner, path, names[1:])
