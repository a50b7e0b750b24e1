"""Tells the problems that pydantic found in a configuration, in the words of the person who wrote the file: place,
expectation, nearest name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from pydantic import AliasChoices, BaseModel, SecretStr, ValidationError
from pydantic_core import ErrorDetails

from mosaic_core.contract.declared.expectations import EXPLAINED, expectation
from mosaic_core.contract.declared.nested_models import models_at
from mosaic_core.runtime.configuration.mistakes.choices import real_place, told_once
from mosaic_core.runtime.configuration.yaml_document import Place, YamlDocument
from mosaic_core.words.errors import Problem, guess, nearest

M = TypeVar("M", bound=BaseModel)

_WANTS_TEXT = ("string_type", "path_type", "bytes_type")
_SECRET_KEYS = frozenset({"token", "credential", "password", "secret", "api_key"})


def validated(
    model: type[M],
    data: Any,
    document: YamlDocument,
    base: Place,
    where_it_belongs: Callable[[Place], str] = lambda _place: "",
) -> tuple[M | None, list[Problem]]:
    """``data``, which stands at ``base`` in the document, as ``model``; or ``None`` and every mistake.

    Where the model wants text and YAML saw a number, a date or a boolean, the text of the file counts.
    Mistakes in values that depend on a missing environment variable are not reported: nobody knows the value.
    ``where_it_belongs`` may know a cure for a key in a place where it isn't taken.
    """
    value, mistakes = _read(model, data)
    texts = {place: document.texts[place] for place in _meant_as_text(mistakes, document, base)}
    if texts:
        for place, text in texts.items():
            data = _replaced(data, place[len(base) :], text)
        value, mistakes = _read(model, data)
    problems = []
    for mistake, word in told_once(_without_misspelt(mistakes, model), document, base):
        place = real_place(mistake["loc"], document, base)
        if any(place[:length] in document.unknown for length in range(len(place) + 1)):
            continue
        if mistake["type"] == "extra_forbidden":
            cure = where_it_belongs(place) or _nearest_key(mistake["loc"], model)
            problems.append(document.problem(place, f"unknown key '{place[-1]}'", cure=cure))
        else:
            problems.append(_problem(mistake, place, model, document, word))
    return value, problems


def _read(model: type[M], data: Any) -> tuple[M | None, list[ErrorDetails]]:
    """``data`` as ``model``, or ``None`` and what pydantic says against it."""
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        return None, error.errors(include_url=False)


def _without_misspelt(mistakes: list[ErrorDetails], model: type[BaseModel]) -> list[ErrorDetails]:
    """Without what is only missing because its key is misspelt: that key is told, with the one that was meant."""
    unknown = [one["loc"] for one in mistakes if one["type"] == "extra_forbidden"]
    meant = {(*loc[:-1], nearest(str(loc[-1]), known_keys(model, loc[:-1]))) for loc in unknown}
    return [one for one in mistakes if one["type"] != "missing" or one["loc"] not in meant]


def sound_part(model: type[M], data: Any, document: YamlDocument, base: Place) -> M | None:
    """``data`` without the values that :func:`validated` complains of, so that the rest can be checked further;
    ``None`` where no rest is left that makes sense."""
    for mistake in _read(model, data)[1]:
        place = real_place(mistake["loc"], document, base)[len(base) :]
        if not place:
            return None
        data = _without(data, place)
    return _read(model, data)[0]


def _without(data: Any, place: Place) -> Any:
    """A copy of ``data`` without the value at ``place``, or the list that has it."""
    key, rest = place[0], place[1:]
    if not isinstance(data, dict) or key not in data:
        return data
    if rest and isinstance(data[key], dict):
        return {**data, key: _without(data[key], rest)}
    return {name: value for name, value in data.items() if name != key}


def _meant_as_text(mistakes: list[ErrorDetails], document: YamlDocument, base: Place) -> Iterator[Place]:
    for mistake in mistakes:
        place = real_place(mistake["loc"], document, base)
        if mistake["type"] in _WANTS_TEXT and place in document.texts and mistake["input"] is not None:
            yield place


def _replaced(data: Any, place: Place, value: Any) -> Any:
    """A copy of ``data`` with ``value`` at ``place``."""
    if not place:
        return value
    key, rest = place[0], place[1:]
    if isinstance(data, dict):
        return {**data, key: _replaced(data[key], rest, value)}
    assert isinstance(key, int)
    return [*data[:key], _replaced(data[key], rest, value), *data[key + 1 :]]


def _problem(mistake: ErrorDetails, place: Place, model: type[BaseModel], document: YamlDocument, word: str) -> Problem:
    loc = mistake["loc"]
    if mistake["type"] == "missing" and isinstance(loc[-1], int):
        return document.problem(place, f"item {loc[-1] + 1} of the list is missing", cure=_description(model, loc[:-1]))
    if mistake["type"] == "missing":
        return document.problem((*place, loc[-1]), f"'{loc[-1]}' is missing", cure=_description(model, loc))
    message, meant = expectation(mistake, str(place[-1]) if place else "", word)
    cure = _description(model, loc) if mistake["type"] == "literal_error" else _form(mistake)
    got = "" if mistake["type"] in EXPLAINED else _shown(mistake["input"], place, document)
    return document.problem(place, message + got + _empty_references(place, document), cure=cure, guess=meant)


def _form(mistake: ErrorDetails) -> str:
    """How YAML writes what was expected, where a list and a mapping were taken for each other."""
    is_list_wanted = mistake["type"] in ("list_type", "tuple_type", "set_type", "frozen_set_type")
    if is_list_wanted and isinstance(mistake["input"], dict):
        return "begin each entry with `- `"
    is_mapping_wanted = mistake["type"] in ("dict_type", "model_type", "model_attributes_type")
    return "write its keys without `- `" if is_mapping_wanted and isinstance(mistake["input"], list) else ""


def _empty_references(place: Place, document: YamlDocument) -> str:
    """What is written at ``place`` or below it and came out empty: the variable is there, but nothing in it."""
    below = [one for one in document.secret if one[: len(place)] == place and not document.texts[one]]
    return "".join(f"; {document.secret[one]} is set, but empty" for one in below)


def _shown(value: Any, place: Place, document: YamlDocument) -> str:
    is_secret = place in document.secret or (place and str(place[-1]) in _SECRET_KEYS) or isinstance(value, SecretStr)
    if is_secret or not isinstance(value, str | int | float | bool | None):
        return "" if is_secret or isinstance(value, dict) else f", got {_noun(value)}"
    text = _as_yaml(value)
    return f", got {text}" if len(text) <= 80 else f", got {text[:77]}…"


def _as_yaml(value: str | float | bool | None) -> str:
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _noun(value: Any) -> str:
    return "a list" if isinstance(value, list | tuple) else type(value).__name__


def _nearest_key(loc: tuple[int | str, ...], model: type[BaseModel]) -> str:
    known = known_keys(model, loc[:-1])
    return guess(str(loc[-1]), known, f"known: {', '.join(known)}" if known else "no keys are known here")


def known_keys(model: Any, loc: tuple[int | str, ...]) -> list[str]:
    """The keys that the model at ``loc`` below ``model``, or below any other type, takes."""
    return [name for one in models_at(model, loc) for name in _names(one)]


def _names(model: type[BaseModel]) -> Iterator[str]:
    for name, info in model.model_fields.items():
        alias = info.validation_alias
        yield str(alias.choices[0]) if isinstance(alias, AliasChoices) else str(alias or name)


def _description(model: type[BaseModel], loc: tuple[int | str, ...]) -> str:
    for one in models_at(model, loc[:-1]):
        info = one.model_fields.get(str(loc[-1]))
        if info is not None and info.description:
            return info.description
    return ""
