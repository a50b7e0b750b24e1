"""Refuses safety of a receiver that nothing could follow: fields that its messages don't have, limits, time-outs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.declared.type_arguments import bare_bases
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.field_kinds import kind_of
from mosaic_core.contract.message_fields import MessageFields, has_two_names, message_fields, text_lists
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.words.control import ResourceName
from mosaic_core.words.errors import hint_at
from mosaic_core.words.limits import ImpossibleLimit, clashes
from mosaic_core.words.safety_config import MAX_TIMEOUT_S, FieldBounds

_RESOURCE_NAME = TypeAdapter[str](ResourceName)


def check_fields(cls: type, fields: MessageFields, velocities: Iterable[str], positions: Iterable[str]) -> None:
    """Refuse fields that its messages don't have, and those that would be both. One that a message may say under two
    names is told when the robot starts."""
    velocities, positions = tuple(velocities), tuple(positions)
    for field in velocities:
        if field in positions:
            message = f"'{field}' is in motion_fields and in position_fields."
            raise wrong_declaration(cls, message, "Name it once: is it a standstill when it is 0?")
        if fields.list_of(field) is not None:
            if untyped := _untyped(cls):
                raise wrong_declaration(cls, f"motion_fields names '{field}', and {untyped[0]}", untyped[1])
            message = f"motion_fields names '{field}' in a list, and only positions can stand in one."
            raise wrong_declaration(cls, message, "Give each velocity a field of its own, or leave it out.")
    for name, its in (("motion_fields", velocities), ("position_fields", positions)):
        for field in its:
            _check_known(cls, fields, field, name)


def _untyped(cls: type) -> tuple[str, str] | None:
    """What is missing, and the cure, where its class leaves open which messages it takes."""
    base = next(bare_bases(cls), None)
    if base is None:
        return None
    cure = f"Name their type, such as {base.__name__}[JointTarget]: it says which of its numbers are positions."
    return "it does not say which messages it takes.", cure


def check_lists(cls: type, message_type: Any) -> None:
    """Refuse a ``keyed_by`` that names no two lists of its messages."""
    keyed_by = getattr(message_type, "keyed_by", None)
    if not keyed_by or not is_model(message_type):
        return
    texts, lists = text_lists(schema_of(message_type)), message_fields(message_type).lists
    for path, names in keyed_by.items():
        for wanted, known, what in ((path, {one.path for one in lists}, "numbers"), (names, texts, "texts")):
            if wanted not in known:
                message = f"keyed_by of {message_type.__name__} names '{wanted}', which is no list of {what}."
                has = f"It has: {', '.join(sorted(known))}." if known else f"It has no list of {what}."
                raise wrong_declaration(cls, message, has)


def check_item_names(cls: type, fields: MessageFields, item_names: object) -> None:
    """Refuse names twice, and those of no list: only one that is keyed by another has names."""
    if not isinstance(item_names, Collection) or not item_names:
        return
    names = [*item_names]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise wrong_declaration(cls, f"item_names has '{twice}' twice.", "Name each once.")
    if not any(one.names for one in fields.lists) and fields.message_type is not None and fields.is_known:
        message = "item_names is set, and its messages have no list whose numbers are named."
        raise wrong_declaration(
            cls, message, 'Say in the message which list names which: keyed_by = {"positions": "names"}.'
        )


def check_timeout(cls: type, timeout_s: object, *, has_safe_action: bool) -> None:
    """Refuse a time-out that none can be, and one after which nothing would happen."""
    if not isinstance(timeout_s, int | float):
        return
    if not 0 < timeout_s <= MAX_TIMEOUT_S:
        message = f"timeout_s is {timeout_s:g}, and no time-out."
        raise wrong_declaration(cls, message, f"Write seconds above 0 and up to {MAX_TIMEOUT_S:g}, or None.")
    if not has_safe_action:
        message = "timeout_s is set, and after it nothing would happen: make_safe is not written."
        raise wrong_declaration(cls, message, "Write make_safe(self, cause), or remove timeout_s.")


def check_resource(cls: type, resource: object) -> None:
    """Refuse a name that no lease can have."""
    if isinstance(resource, str):
        try:
            _RESOURCE_NAME.validate_python(resource)
        except ValidationError:
            message = f"the lease of '{resource}' can't be taken."
            cure = "Write small letters, digits, - and _, a letter first, 32 at most."
            raise wrong_declaration(cls, message, cure) from None


def check_bounds(cls: type, limits: object) -> None:
    """Refuse limits that are no bounds."""
    for field, bounds in limits.items() if isinstance(limits, Mapping) else ():
        if not isinstance(bounds, FieldBounds):
            message = f"the limit of '{field}' is a {type(bounds).__name__}."
            raise wrong_declaration(cls, message, "Write FieldBounds(min=…, max=…).")
        if bounds == FieldBounds():
            message = f"the limit of '{field}' bounds nothing."
            raise wrong_declaration(cls, message, "Write FieldBounds(min=…, max=…), or remove it.")


def check_limits(
    cls: type, fields: MessageFields, limits: object, velocities: Iterable[str], positions: Iterable[str]
) -> None:
    """Refuse limits of fields that its messages don't have, and those that nothing can follow."""
    if not isinstance(limits, Mapping):
        return
    found = []
    for field, bounds in limits.items():
        _check_known(cls, fields, field, "limits")
        try:
            kind = kind_of(field, bounds, fields, tuple(velocities), tuple(positions))
            found.append(bounds.limit(field, kind))
        except ImpossibleLimit as wrong:
            if fields.list_of(field) is not None and (untyped := _untyped(cls)):
                raise wrong_declaration(cls, f"limits names '{field}', and {untyped[0]}", untyped[1]) from None
            raise wrong_declaration(cls, f"{wrong}.", f"Cure: {wrong.cure}." if wrong.cure else "Change it.") from None
    for _, message in clashes(found):
        raise wrong_declaration(cls, f"{message}.", "Write limits that can be kept together.")


def _check_known(cls: type, fields: MessageFields, field: str, where: str) -> None:
    if not fields.has(field) and not has_two_names(fields.message_type, field.split(".")):
        message = f"{where} names '{field}', a number that its messages don't have{hint_at(field, fields.names)}"
        none = "They have none; what only switches says motion_fields = (), and is limited by its model."
        raise wrong_declaration(cls, message, f"They have: {', '.join(fields.names)}." if fields.names else none)
