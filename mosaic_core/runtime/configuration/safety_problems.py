"""Finds what ``safety:`` of a connector says that its receivers can't follow: leases that guard nothing, fields that
their messages don't have, limits without a standstill or without a place to begin.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.field_kinds import cure_of_kind, kind_of
from mosaic_core.contract.handler import DataChannelReceivable, Handler, message_type_of, reports_position
from mosaic_core.contract.message_fields import has_two_names
from mosaic_core.contract.message_schema import unit_at
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.contract.units import PLACES
from mosaic_core.machines.commands.number_list import EVERY
from mosaic_core.runtime.configuration.catalogue_entry import receivers
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.receiver_safety import (
    ReceiverSafety,
    bounds_of,
    fields_of,
    kind_for,
    resource_of,
    takes_field,
    with_those_of_all,
)
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import Problem, guess
from mosaic_core.words.limits import FieldLimit, ImpossibleLimit, MotionKind, clashes
from mosaic_core.words.safety_config import FieldBounds


def safety_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """What the ``safety:`` of this connector says that nothing of it can follow."""
    found = receivers(handlers)
    if one.config.safety and not found:
        message = f"connector '{one.config.label}' ('{one.config.type}') receives nothing that could be limited"
        yield one.problem(message, "safety", cure="remove `safety:`")
    yield from _idle_resource(one, found)
    moving = [handler for handler in found if not isinstance(handler, RequestHandler)]  # those have a word of their own
    yield from _unknown_fields(one, moving)
    for handler in moving:
        yield from _receiver_problems(one, handler, is_alone=len(found) == 1)


def _idle_resource(one: CheckedConnector, found: list[DataChannelReceivable[Any]]) -> Iterator[Problem]:
    safety = one.safety
    if found and "resource" in safety.model_fields_set and all(resource_of(safety, its) is None for its in found):
        message = (
            f"connector '{one.config.label}' needs no lease to be commanded, so '{safety.resource}' guards nothing"
        )
        yield one.problem(message, "safety", "resource", cure="add `requires_lease: true`, or remove `resource`")
    for handler in found:
        if _names_idle_resource(safety, handler):
            kind = type(handler)
            whose = f"{one.whose}: {kind.__name__}"
            cure = f"write requires_lease = True in {kind.__name__}, or remove its resource"
            message = f"{whose} needs no lease, so that its resource '{handler.resource}' guards nothing"
            yield one.broken(message, cure=cure, at=code_of(kind))


def _names_idle_resource(safety: SafetyConfig, handler: DataChannelReceivable[Any]) -> bool:
    """Whether its class names a lease that it does not need, and the file says nothing else."""
    is_named = handler.resource != DataChannelReceivable.resource and safety.requires_lease is None
    return is_named and not handler.requires_lease


def _unknown_fields(one: CheckedConnector, found: list[DataChannelReceivable[Any]]) -> Iterator[Problem]:
    """Limits of the file that say nothing, or are of no receiver's messages."""
    known = [(handler, fields_of(handler, one.safety)) for handler in found]
    written = (one.config.safety or {}).get("limits", {})
    for field in (field for field in one.safety.limits if known and written.get(field) == {}):
        message = f"the limit of '{field}' of connector '{one.config.label}' bounds nothing"
        yield one.problem(message, "safety", "limits", field, cure="write min, max or a rate, or remove it")
    taking = [its for _, its in known if its.message_type not in (str, bytes)]
    for field in sorted(one.safety.limits) if taking else ():
        if not any(takes_field(handler, fields, field) for handler, fields in known):
            names = sorted({name for its in taking for name in its.names})
            cure = guess(field, names, f"they have: {', '.join(names)}")
            message = f"the messages of connector '{one.config.label}' have no number '{field}'"
            yield one.problem(message, "safety", "limits", field, cure=cure)


def _receiver_problems(
    one: CheckedConnector, handler: DataChannelReceivable[Any], *, is_alone: bool
) -> Iterator[Problem]:
    found = list(_limit_problems(one, handler))
    yield from (problem for _, problem in found)
    # What else is wrong is told at once, as if the limits that can't be kept were not there.
    sound = {field: its for field, its in one.safety.limits.items() if field not in {bad for bad, _ in found}}
    safety = one.safety.model_copy(update={"limits": sound})
    try:
        effective = ReceiverSafety.of(safety, handler)
    except ImpossibleLimit:
        return  # by its class alone
    limited = (field for limit in effective.limits for field in limit.fields)
    fields = {*effective.motion_fields, *effective.position_fields, *limited}
    is_plain = message_type_of(type(handler)) in (str, bytes)
    if is_plain and (fields or (one.safety.limits and is_alone)):
        message = f"connector '{one.config.label}' takes no JSON messages, so none of their fields can be limited"
        yield one.problem(message, "safety", "limits", cure="remove `limits`")
        return
    yield from _zero_problems(one, effective, has_fields=bool(fields))
    yield from _rate_problems(one, handler, effective)
    yield from _field_problems(one, handler, fields)


def _limit_problems(one: CheckedConnector, handler: DataChannelReceivable[Any]) -> Iterator[tuple[str, Problem]]:
    """Of each limit alone, of its kind and the handler's, and of several limits of one field; with the field."""
    label, fields, found = one.config.label, fields_of(handler, one.safety), []
    bad: set[str] = set()
    its_bounds = with_those_of_all(bounds_of(handler, one.safety), fields)
    for field in sorted(its_bounds, key=lambda field: not field.endswith(f".{EVERY}")):
        bounds, its_list = its_bounds[field], fields.list_of(field)
        if its_list is not None and its_list.every in bad:
            continue  # it has that mistake from there
        own = kind_for(handler, one.safety, field)
        if own is not None and bounds.kind not in (None, own):
            message = f"'{field}' is a {own} to connector '{label}', and can't be limited as a {bounds.kind}"
            yield field, _limit_problem(one, handler, message, field, "kind", cure=cure_of_kind(own))
            bounds = bounds.model_copy(update={"kind": None})
        if own is None and bounds.kind is None and (unit := unit_at(fields.message_type, field)) in PLACES:
            message = f"'{field}' of connector '{label}' is in {unit}: is it a place? As a velocity it would begin at 0"
            yield field, _limit_problem(one, handler, message, field, cure=_KIND_CURE)
            bounds = bounds.model_copy(update={"kind": "position", "max_rise_per_s": None, "max_fall_per_s": None})
        kind = own or kind_of(field, bounds, fields, handler.motion_fields, handler.position_fields)
        wrongs, limit = _sound_limit(field, bounds, kind)
        for wrong in wrongs:
            bad.add(field)
            key, cure = _half_of_the_class(one, handler, field, bounds, wrong) or (wrong.key, wrong.cure)
            keys = (key,) if key else ()
            yield field, _limit_problem(one, handler, f"connector '{label}': {wrong}", field, *keys, cure=cure)
        found += [limit] if limit is not None else []
    for field, message in clashes((*one.safety.field_limits(), *found)):
        cure = "write limits that can be kept together"
        yield field, _limit_problem(one, handler, f"connector '{label}': {message}", field, cure=cure)


_KIND_CURE = "write `kind: position` with max_rate_per_s, or `kind: velocity` if 0 is its standstill"


def _half_of_the_class(
    one: CheckedConnector, handler: DataChannelReceivable[Any], field: str, bounds: FieldBounds, wrong: ImpossibleLimit
) -> tuple[str, str] | None:
    """Key and cure where the file bounds one side alone, beyond what its class says of the other: nothing to swap."""
    said = one.safety.limits.get(field)
    if said is None or not wrong.is_order or (said.min is None) == (said.max is None):
        return None
    key, other, word = ("min", "max", "most") if said.max is None else ("max", "min", "least")
    kind, bound = type(handler).__name__, getattr(bounds, other)
    return key, f"{other} {bound:g} is of {kind}: write a {key} of at {word} {bound:g}, or a {other} of your own"


def _sound_limit(field: str, bounds: FieldBounds, kind: MotionKind) -> tuple[list[ImpossibleLimit], FieldLimit | None]:
    """Every mistake of one limit, and what is left of it without them; ``None`` where they are of the whole."""
    wrongs: list[ImpossibleLimit] = []
    while True:
        try:
            limit = bounds.limit(field, kind)
        except ImpossibleLimit as wrong:
            wrongs.append(wrong)
            if not wrong.key or getattr(bounds, wrong.key) is None:
                return wrongs, None
            bounds = bounds.model_copy(update={wrong.key: None})
        else:
            return wrongs, None if wrongs else limit


def _limit_problem(
    one: CheckedConnector, handler: DataChannelReceivable[Any], message: str, field: str, *key: str, cure: str
) -> Problem:
    """At the limit of the file, else whose class has it."""
    if field in one.safety.limits:
        return one.problem(message, "safety", "limits", field, *key, cure=cure)
    return one.broken(message, cure=cure, at=code_of(type(handler)))


def _zero_problems(one: CheckedConnector, effective: ReceiverSafety, *, has_fields: bool) -> Iterator[Problem]:
    for key in ("on_timeout", "on_loss"):
        if getattr(one.safety, key) != "zero":
            continue
        if effective.position_fields:
            fields = " and ".join(f"'{field}'" for field in effective.position_fields)
            message = f"connector '{one.config.label}' takes {fields} as a position, and 0 is no standstill of one"
            cure = "write `callback`, or `hold` if it may stay where it is"
            yield one.problem(message, "safety", key, cure=cure)
        elif not has_fields:
            message = f"connector '{one.config.label}' names no motion fields that could be set to zero"
            yield one.problem(message, "safety", key, cure="write `callback`, or name its fields in `limits`")


def _rate_problems(
    one: CheckedConnector, handler: DataChannelReceivable[Any], effective: ReceiverSafety
) -> Iterator[Problem]:
    """A limited rate must begin somewhere, and what is reported must be the place of something."""
    if reports_position(handler):
        yield from _unasked_reports(one, handler, effective)
        return
    fields = [" and ".join(limit.fields) for limit in effective.limits if limit.max_rate_per_s is not None]
    if not fields:
        return
    names, are = " and ".join(map(repr, fields)), "is" if len(fields) == 1 else "are"
    message = f"connector '{one.config.label}' does not report where {names} {are}, so a rate can't begin anywhere"
    cure = f"let {type(handler).__name__} implement reported_position, or remove max_rate_per_s"
    named = next((field for field in fields if field in one.safety.limits), fields[0])
    yield _limit_problem(one, handler, message, named, "max_rate_per_s", cure=cure)


def _unasked_reports(
    one: CheckedConnector, handler: DataChannelReceivable[Any], effective: ReceiverSafety
) -> Iterator[Problem]:
    """Rates of velocities alone, though it says where something is: nobody would ask it, and after a safe action what
    is a place would begin at 0."""
    if effective.position_fields:
        return
    for limit in effective.limits:
        if limit.max_rise_per_s is None and limit.max_fall_per_s is None:
            continue
        name = " and ".join(limit.fields)
        message = (
            f"connector '{one.config.label}' reports positions, and '{name}' is limited as a velocity: a rate would "
            "begin at 0 instead of where it is"
        )
        kind = type(handler).__name__
        cure = f"write `kind: position` and max_rate_per_s, name it in position_fields of {kind}, or drop its report"
        yield _limit_problem(one, handler, message, name, cure=cure)


def _field_problems(one: CheckedConnector, handler: DataChannelReceivable[Any], fields: set[str]) -> Iterator[Problem]:
    """Of each field that is limited or moves something: its messages must have it, under one name."""
    message_type, known = message_type_of(type(handler)), fields_of(handler, one.safety)
    names = {its.names for field in fields if (its := known.list_of(field)) is not None and its.names}
    twice = {field for field in (*fields, *names) if has_two_names(message_type, field.split("."))}
    for field in sorted(twice):
        message = f"'{field}' of the messages of connector '{one.config.label}' can be written under two names"
        cure = "give it one name in its model: a limit sees no other"
        yield one.problem(message, "safety", code="config.broken_plugin", cure=cure)
    for field in sorted(field for field in fields - twice if not known.has(field)):
        cure = guess(field, known.names, f"they have: {', '.join(known.names)}")
        message = f"{one.whose} moves by '{field}', a number that its messages don't have: nothing would limit it"
        yield one.broken(message, cure=cure, at=code_of(type(handler)))
