"""Finds the numbers of a message by their dotted paths, as limits and motion fields name them, and its lists of
numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import AliasChoices, AliasPath

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.contract.params import Message
from mosaic_core.machines.commands.number_list import EVERY, NumberList
from mosaic_core.words.limits import MotionKind

_MAX_DEPTH = 5
"""A model may contain itself."""


def has_two_names(model: Any, path: list[str]) -> bool:
    """Whether a message may say a field on this path by another name than the one that is limited."""
    if not path or not is_model(model):
        return False
    takes_both = model.model_config.get("populate_by_name") or model.model_config.get("validate_by_name")
    for name, info in model.model_fields.items():
        alias = info.validation_alias or info.alias
        names = [name] if alias is None else alias.choices if isinstance(alias, AliasChoices) else [alias]
        if path[0] in names or path[0] == name:
            if len(names) > 1 or isinstance(names[0], AliasPath) or (takes_both and names != [name]):
                return True
            return any(has_two_names(inner, path[1:]) for inner in (info.annotation, *get_args(info.annotation)))
    return False


def may_lack(model: Any, path: Sequence[str]) -> bool:
    """Whether a message may be without the field on this path, so that there is no value at all, not even a default."""
    if not path or not is_model(model):
        return False
    named = {info.validation_alias or info.alias or name: info for name, info in model.model_fields.items()}
    info = named.get(path[0])
    if info is None or len(path) == 1:
        return info is not None and not info.is_required() and info.get_default() is None and not info.default_factory
    return any(may_lack(inner, path[1:]) for inner in (info.annotation, *get_args(info.annotation)))


def is_bound(field: str) -> bool:
    """Whether the number bounds something itself, as its name says: ``max_effort``."""
    return field.rpartition(".")[2].startswith("max_")


@dataclass(frozen=True, slots=True)
class MessageFields:
    """The numbers of one type of messages: ``numbers``, by dotted path, and those in ``lists``. Of a type that says
    nothing any field may be there."""

    numbers: frozenset[str] = frozenset()
    lists: tuple[NumberList, ...] = ()
    is_known: bool = False
    """Whether the type says what its messages have."""
    message_type: Any = None

    def list_of(self, field: str) -> NumberList | None:
        """The list that has ``field``."""
        return next((one for one in self.lists if one.holds(field)), None)

    def has(self, field: str) -> bool:
        """Whether a message may have it, as far as anybody knows."""
        its = self.list_of(field)
        return field in self.numbers or (not self.is_known if its is None else its.could_hold(field))

    def of_kind(self, kind: MotionKind) -> tuple[str, ...]:
        """The fields that a message says are of this kind; of a list of positions ``path.*``."""
        if not (is_model(self.message_type) and issubclass(self.message_type, Message)):
            return ()
        lists = {one.path: one.every for one in self.lists} if kind == "position" else {}
        paths = [path for path, its in self.message_type.motion_kinds.items() if its == kind]
        return tuple(lists.get(path, path) for path in paths if path in self.numbers or path in lists)

    @property
    def names(self) -> list[str]:
        """What may be written, for cures: every number, and for a list ``path.*`` and the names that are known."""
        in_lists = (name for one in self.lists for name in (one.every, *(f"{one.path}.{key}" for key in one.known)))
        return sorted((*self.numbers, *in_lists))


def message_fields(message_type: Any, used: Iterable[str] = (), known: Collection[str] = ()) -> MessageFields:
    """What messages of this type have. Of those without a schema every ``used`` field that is spelt so (``a.*``,
    ``a.0``) stands in a list. ``known``: the names that lists which are keyed by another may have."""
    if not is_model(message_type):
        return MessageFields(lists=_spelt_lists(used), message_type=message_type)
    schema, names_of = schema_of(message_type), getattr(message_type, "keyed_by", {})
    definitions = schema.get("$defs", {})
    lists = []
    for path in sorted(_paths(schema, definitions, 0, _is_number_list)):
        names = names_of.get(path, "")
        choices = frozenset(known) if known else _choices_at(schema, names)
        lists.append(NumberList(path, names, choices if names else frozenset()))
    numbers = frozenset(_paths(schema, definitions, 0, _is_number))
    is_known = bool(numbers or lists) or not _is_open(schema, definitions, 0)
    return MessageFields(numbers, tuple(lists), is_known, message_type)


def text_lists(schema: dict[str, Any]) -> frozenset[str]:
    """The dotted paths of all lists of texts, by which another list may be keyed."""
    return frozenset(_paths(schema, schema.get("$defs", {}), 0, _is_text_list))


def _spelt_lists(used: Iterable[str]) -> tuple[NumberList, ...]:
    apart = (field.rpartition(".") for field in used)
    return tuple(NumberList(path) for path in dict.fromkeys(path for path, _, key in apart if _is_key(key) and path))


def _is_key(key: str) -> bool:
    return key == EVERY or key.isdecimal()


Test = Callable[[dict[str, Any], dict[str, Any]], bool]


def _paths(schema: dict[str, Any], definitions: dict[str, Any], depth: int, wanted: Test) -> Iterator[str]:
    for name, field in schema.get("properties", {}).items():
        for inner in _choices(field, definitions):
            if wanted(inner, definitions):
                yield name
            elif depth < _MAX_DEPTH:
                yield from (f"{name}.{path}" for path in _paths(inner, definitions, depth + 1, wanted))


def _choices(field: dict[str, Any], definitions: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A schema and its alternatives, with what they refer to in the place of references."""
    for choice in (field, *(one for kind in ("anyOf", "allOf", "oneOf") for one in field.get(kind, ()))):
        yield definitions.get(str(choice.get("$ref", "")).rsplit("/", 1)[-1], choice)


def _is_open(schema: dict[str, Any], definitions: dict[str, Any], depth: int) -> bool:
    """Whether there may be fields that the schema does not name: keys of any name, or values of any kind."""
    if depth > _MAX_DEPTH or not schema.get("properties") or schema.get("additionalProperties"):
        return True
    inner = (one for field in schema["properties"].values() for one in _choices(field, definitions))
    return any(_is_open(one, definitions, depth + 1) for one in inner if _is_object(one))


def _is_object(schema: dict[str, Any]) -> bool:
    return schema.get("type", "object") == "object" and not schema.keys() & {"enum", "const", "anyOf", "allOf", "oneOf"}


def _is_number(schema: dict[str, Any], definitions: dict[str, Any]) -> bool:
    return schema.get("type") in ("number", "integer")


def _is_number_list(schema: dict[str, Any], definitions: dict[str, Any]) -> bool:
    items = [*schema.get("prefixItems", ()), *([schema["items"]] if isinstance(schema.get("items"), dict) else [])]
    return schema.get("type") == "array" and bool(items) and all(_are(item, definitions, _is_number) for item in items)


def _is_text_list(schema: dict[str, Any], definitions: dict[str, Any]) -> bool:
    items = schema.get("items")
    is_text: Test = lambda item, _: item.get("type") == "string"  # noqa: E731
    return schema.get("type") == "array" and isinstance(items, dict) and _are(items, definitions, is_text)


def _are(item: dict[str, Any], definitions: dict[str, Any], wanted: Test) -> bool:
    return any(wanted(one, definitions) for one in _choices(item, definitions))


def _choices_at(schema: dict[str, Any], path: str) -> frozenset[str]:
    """The texts that the list at ``path`` may have, where its schema enumerates them."""
    definitions, node = schema.get("$defs", {}), schema
    for name in path.split(".") if path else ():
        field = node.get("properties", {}).get(name, {})
        node = next((one for one in _choices(field, definitions) if "properties" in one or "items" in one), {})
    items = node.get("items", {})
    found = [one for one in _choices(items, definitions) if "enum" in one or "const" in one]
    return frozenset(str(text) for one in found for text in one.get("enum", [one.get("const")]))
