"""Finds what a configuration can't mean of its handlers: limits of a receiver, deliveries, cameras that ``params`` name
and the robot does not have. Told before anything starts, with the nearest name that would make sense.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar, get_args

from pydantic import AliasChoices, AliasPath, BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Handler, MediaTrackHandler, message_type_of
from mosaic_core.contract.params import CameraLabel, OwnFolder
from mosaic_core.machines.delivery.delivery_terms import chosen, contradictions
from mosaic_core.runtime.configuration.catalogue_entry import message_schema, receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.config_problems import real_place
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.configuration.resolver import guess
from mosaic_core.words.data_type import Direction, MosaicDataType
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
    yield from _field_problems(one, handler, fields)


def _field_problems(one: CheckedConnector, handler: DataChannelReceivable[Any], fields: set[str]) -> Iterator[Problem]:
    """Of each field that is limited or moves something: its messages must have it, under one name."""
    twice = {field for field in fields if _has_two_names(message_type_of(type(handler)), field.split("."))}
    for field in sorted(twice):
        message = f"'{field}' of the messages of connector '{one.config.label}' can be written under two names"
        cure = "give it one name in its model: a limit sees no other"
        yield one.problem(message, "safety", code="config.broken_plugin", cure=cure)
    known = field_paths(message_schema(handler))
    unknown = [field for field in sorted(fields - twice) if known and field not in known]
    for field in unknown:
        cure = guess(field, sorted(known), f"they have: {', '.join(sorted(known))}")
        if field in one.safety.limits:
            message = f"the messages of connector '{one.config.label}' have no number '{field}'"
            yield one.problem(message, "safety", "limits", field, cure=cure)
        else:
            message = f"connector '{one.config.label}' of {one.installed.source} moves by '{field}'"
            yield one.broken(f"{message}, a number that its messages don't have: nothing would limit it", cure=cure)


def guard_hints(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """What the framework can't do for a receiver that says it moves something, but not by which numbers."""
    for handler in receivers(handlers):
        safety, message_type = ReceiverSafety.of(one.safety, handler), message_type_of(type(handler))
        is_mover = safety.timeout_s is not None or type(handler).make_safe is not DataChannelReceivable.make_safe
        if not is_mover or safety.motion_fields or safety.limits or getattr(message_type, "motion_kinds", None):
            continue
        message = (
            f"nothing says which numbers move connector '{one.config.label}': a bad link does not slow it down, and "
            "after a stop was cleared no zero lets it go on, only silence"
        )
        cure = "name them in `limits`, or in the `motion_fields` of its class"
        if message_type in (str, bytes):
            cure = "it takes no JSON messages, so it can't: let it stop quickly by itself"
        yield one.problem(message, "safety", cure=cure)


def delivery_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Contradictions of what the file says, alone or together with the connector's own choice."""
    contract = chosen(handlers[0].delivery, one.config.delivery)
    sends = any(handler.direction is not Direction.TO_ROBOT for handler in handlers)
    is_media = all(handler.data_type is MosaicDataType.MEDIA for handler in handlers)
    for key, message, cure in contradictions(contract, sends=sends, is_media=is_media):
        if one.config.delivery is not None and getattr(one.config.delivery, key) is not None:
            yield one.problem(f"connector '{one.config.label}': {message}", "delivery", key, cure=cure)
        else:
            whose = f"connector '{one.config.label}' of {one.installed.source}"
            yield one.broken(f"{whose} chose a delivery that can't be: {message}", cure=cure)


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
        for choice in (field, *(one for kind in ("anyOf", "allOf", "oneOf") for one in field.get(kind, ()))):
            inner = definitions.get(str(choice.get("$ref", "")).rsplit("/", 1)[-1], choice)
            if inner.get("type") in ("number", "integer"):
                yield name
            elif depth < _MAX_DEPTH:
                yield from (f"{name}.{path}" for path in _numbers(inner, definitions, depth + 1))


WithHandlers: TypeAlias = tuple[CheckedConnector, tuple[Handler, ...]]
Loc: TypeAlias = tuple[int | str, ...]


def label_problems(made: Sequence[WithHandlers]) -> Iterator[Problem]:
    """Every :class:`CameraLabel` that is none. ``made``: all connectors that could be made; what the others of the file
    would have been, nobody knows."""
    types = {
        label: one.config.type
        for one, handlers in made
        for label in (one.config.label, *(handler.label for handler in handlers))
    }
    cameras = [handler.label for _, handlers in made for handler in handlers if isinstance(handler, MediaTrackHandler)]
    unmade = _unmade([one for one, _ in made])
    for one, _ in made:
        for loc, label in named_in(one.params, CameraLabel):
            if label in cameras or (label not in types and any(label.startswith(other) for other in unmade)):
                continue
            what = f"which is of type '{types[label]}'" if label in types else "which this robot does not have"
            message = f"connector '{one.config.label}' names the camera '{label}', {what}"
            place = real_place(loc, one.document, (*one.place, "params"))
            there_are = f"it has: {', '.join(cameras)}" if cameras else "add a camera with this label"
            meant = guess(label, [*cameras, *sorted(unmade)])
            yield one.document.problem(place, message, cure=there_are, guess=meant)


N = TypeVar("N", CameraLabel, OwnFolder)


def named_in(value: object, kind: type[N], loc: Loc = ()) -> Iterator[tuple[Loc, N]]:
    """The texts of this kind in ``params``, each with its way from there."""
    parts: Iterator[tuple[Any, Any]] = iter(())
    if isinstance(value, kind):
        yield loc, value
    elif isinstance(value, BaseModel):
        parts = ((name, getattr(value, name)) for name in type(value).model_fields)
    elif isinstance(value, Mapping):
        for key in value:
            yield from named_in(key, kind, (*loc, key))
        parts = iter(value.items())
    elif isinstance(value, list | tuple | set | frozenset):
        parts = enumerate(value)
    for key, inner in parts:
        yield from named_in(inner, kind, (*loc, key))


def _unmade(made: Sequence[CheckedConnector]) -> set[str]:
    """Labels of connectors with mistakes of their own, whose handlers may have labels that begin like theirs. Empty
    text stands for one that depends on a missing variable and may be any."""
    if not made:
        return set()
    document, labels, found = made[0].document, {one.config.label for one in made}, set[str]()
    for index, raw in enumerate(document.tree.get("connectors") or ()):
        label = raw.get("label") if isinstance(raw, dict) else None
        if ("connectors", index, "label") in document.unknown:
            found.add("")
        elif label is not None and str(label) not in labels:
            found.add(str(label))
    return found
