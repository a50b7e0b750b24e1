"""Limits that make no sense for a receiver: told before anything starts, with the nearest name that would."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from pydantic import AliasChoices, AliasPath, BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Handler, message_type_of
from mosaic_core.runtime.configuration.catalogue_entry import message_schema, receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.resolver import nearest
from mosaic_core.words.errors import Problem

_MAX_DEPTH = 5
"""A model may contain itself."""


def safety_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """What the ``safety:`` of this connector says that nothing of it can follow."""
    found = receivers(handlers)
    if one.config.safety and not found:
        message = f"connector '{one.config.label}' ('{one.config.type}') receives nothing that could be limited"
        yield one.problem(message, "safety", cure="remove `safety:`")
    for handler in found:
        yield from _receiver_problems(one, handler)


def _receiver_problems(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[Problem]:
    safety = one.safety
    needs_lease = handler.requires_lease if safety.requires_lease is None else safety.requires_lease
    if "resource" in safety.model_fields_set and not needs_lease:
        message = (
            f"connector '{one.config.label}' needs no lease to be commanded, so '{safety.resource}' guards nothing"
        )
        yield one.problem(message, "safety", "resource", cure="add `requires_lease: true`, or remove `resource`")
    fields = {*handler.motion_fields, *(field for limit in safety.every_limit() for field in limit.fields)}
    if message_type_of(type(handler)) in (str, bytes) and fields:
        message = f"connector '{one.config.label}' takes no JSON messages, so none of their fields can be limited"
        yield one.problem(message, "safety", "limits", cure="remove `limits`")
        return
    for key in ("on_timeout", "on_loss"):
        if getattr(safety, key) == "zero" and not fields:
            message = f"connector '{one.config.label}' names no motion fields that could be set to zero"
            yield one.problem(message, "safety", key, cure="write `callback`, or name its fields in `limits`")
    for field in sorted(fields):
        if _has_two_names(message_type_of(type(handler)), field.split(".")):
            message = f"'{field}' of the messages of connector '{one.config.label}' can be written under two names"
            cure = "give it one name in its model: a limit sees no other"
            yield one.problem(message, "safety", code="config.broken_plugin", cure=cure)
    known = field_paths(message_schema(handler))
    for field in safety.limits:
        if known and field not in known:
            guess = nearest(field, sorted(known))
            message = f"the messages of connector '{one.config.label}' have no number '{field}'"
            cure = f"did you mean '{guess}'?" if guess else f"they have: {', '.join(sorted(known))}"
            yield one.problem(message, "safety", "limits", field, cure=cure)


def _has_two_names(model: Any, path: list[str]) -> bool:
    """Whether a message may say a field on this path by another name than the one that is limited."""
    if not path or not (isinstance(model, type) and issubclass(model, BaseModel)):
        return False
    takes_both = model.model_config.get("populate_by_name") or model.model_config.get("validate_by_name")
    for name, info in model.model_fields.items():
        alias = info.validation_alias or info.alias
        names = [name] if alias is None else alias.choices if isinstance(alias, AliasChoices) else [alias]
        if path[0] in names or path[0] == name:
            if len(names) > 1 or isinstance(names[0], AliasPath) or (takes_both and names != [name]):
                return True
            return any(_has_two_names(inner, path[1:]) for inner in (info.annotation, *get_args(info.annotation)))
    return False


def field_paths(schema: dict[str, Any] | None) -> frozenset[str]:
    """The dotted paths of all numbers that a JSON Schema names; none where it names no properties."""
    return frozenset(_numbers(schema, schema.get("$defs", {}), 0)) if schema is not None else frozenset()


def _numbers(schema: dict[str, Any], definitions: dict[str, Any], depth: int) -> Iterator[str]:
    for name, field in schema.get("properties", {}).items():
        for choice in (field, *field.get("anyOf", ()), *field.get("allOf", ())):
            inner = definitions.get(str(choice.get("$ref", "")).rsplit("/", 1)[-1], choice)
            if inner.get("type") in ("number", "integer"):
                yield name
            elif depth < _MAX_DEPTH:
                yield from (f"{name}.{path}" for path in _numbers(inner, definitions, depth + 1))
