"""Checks what the author of a handler class declares, at the moment the class is made: nothing that is written there is
ignored silently. An error names the class, its file and line, and the cure.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from mosaic_core.contract.field_kinds import kind_of
from mosaic_core.contract.message_fields import MessageFields, has_two_names, message_fields, text_lists
from mosaic_core.words.catalogue import WIDGET_HINTS, is_widget_hint
from mosaic_core.words.control import ResourceName
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import MosaicError, hint_at
from mosaic_core.words.limits import ImpossibleLimit, clashes
from mosaic_core.words.safety_config import MAX_TIMEOUT_S, FieldBounds


def wrong_declaration(cls: type, message: str, cure: str) -> MosaicError:
    """The error for a class that is being made."""
    place = _place_of(cls)
    return MosaicError(f"{place}: {cls.__qualname__}: {message} {cure}", code="config.broken_plugin", cure=cure)


def check_bodies(cls: type, owners: Mapping[str, str]) -> None:
    """Refuse a method that the framework calls on other handlers only. ``owners``: its name → the base that has it."""
    for name, owner in owners.items():
        if name in vars(cls) and not any(hasattr(base, name) for base in cls.__mro__[1:]):
            message = f"nobody calls its {name}()."
            raise wrong_declaration(cls, message, f"Derive it from {owner}, or give the method another name.")


DECLARED = (
    "at_once", "answer_within_s", "delivery", "handle_data", "handle_sound", "is_for_originals", "item_names",
    "make_safe", "messages", "motion_fields", "peer_left", "position_fields", "reported_position", "requires_lease",
    "resource", "takes_observers", "timeout_s",
)  # fmt: skip
"""What authors write in the body of a class. Words that others may mean (``frame``, ``limit``) are left out."""
_ALIKE = 0.85


def check_spelling(cls: type) -> None:
    """Refuse a public name that is almost one of :data:`DECLARED` that this class could have: the framework would not
    see it."""
    known = [name for name in DECLARED if hasattr(cls, name)]
    for name in vars(cls):
        is_own = name.startswith("_") or name in known or any(hasattr(base, name) for base in cls.__mro__[1:])
        meant = [] if is_own else get_close_matches(name, known, n=1, cutoff=_ALIKE)
        if meant and name + "s" != meant[0]:
            message = f"it has '{name}', which nothing reads; did you mean '{meant[0]}'?"
            raise wrong_declaration(cls, message, f"Write {meant[0]}, or begin a name of your own with _.")


def check_media_delivery(cls: type, delivery: Delivery | DeliveryContract) -> None:
    """Refuse anything but ``latest`` for pictures and sound, which are no messages."""
    mode = delivery if isinstance(delivery, Delivery) else delivery.mode
    if mode not in (None, Delivery.LATEST):
        message = f"pictures and sound are never delivered as {mode}."
        raise wrong_declaration(cls, message, "Leave `delivery` out: their pace and bounds are params.")


def check_delivery(cls: type, delivery: object) -> None:
    """Refuse a delivery that is no mode and no contract."""
    if not isinstance(delivery, Delivery | DeliveryContract) and not hasattr(delivery, "__get__"):
        message = f"delivery is {delivery!r}, and no way to deliver."
        ways = ", ".join(f"Delivery.{one.name}" for one in Delivery)
        raise wrong_declaration(cls, message, f"Write one of {ways}, or a DeliveryContract.")


def check_safe_action(cls: type) -> None:
    """Refuse a ``make_safe`` that the safety thread can't run to its end by a plain call with the cause."""
    written = vars(cls).get("make_safe")
    if not inspect.isfunction(written):
        return
    is_run_later = inspect.iscoroutinefunction(written) or inspect.isgeneratorfunction(written)
    if is_run_later or inspect.isasyncgenfunction(written):
        message = "make_safe is async or yields, and the safety thread would run nothing of it."
        raise wrong_declaration(cls, message, "Write it as a plain `def make_safe(self, cause)`.")
    try:
        inspect.signature(written).bind(None, "safety.timeout")
    except TypeError as error:
        message = f"make_safe can't be called with the cause ({error})."
        raise wrong_declaration(cls, message, "Write `def make_safe(self, cause)`.") from None


def check_widget(cls: type, widget: object) -> None:
    """Refuse the name of a widget that nobody has."""
    if widget is not None and not isinstance(widget, str) and not hasattr(widget, "__get__"):
        raise wrong_declaration(cls, f"widget is {widget!r}, and no name.", f"There are: {', '.join(WIDGET_HINTS)}.")
    if isinstance(widget, str) and not is_widget_hint(widget):
        message = f"there is no widget '{widget}'{hint_at(widget, WIDGET_HINTS)}"
        cure = f"There are: {', '.join(WIDGET_HINTS)}; a plugin's own is written as distribution/Name."
        raise wrong_declaration(cls, message, cure)


def check_sent(cls: type, sends: object) -> None:
    """Refuse a type of what it sends that is none."""
    if sends is not None and not (isinstance(sends, type) and issubclass(sends, BaseModel)):
        message = f"sends is {sends!r}, and no type of messages."
        raise wrong_declaration(cls, message, "Name a subclass of Message, or leave it out.")


def check_fields(cls: type, fields: MessageFields, velocities: Iterable[str], positions: Iterable[str]) -> None:
    """Refuse fields that its messages don't have, and those that would be both. One that a message may say under two
    names is told when the robot starts."""
    velocities, positions = tuple(velocities), tuple(positions)
    for field in velocities:
        if field in positions:
            message = f"'{field}' is in motion_fields and in position_fields."
            raise wrong_declaration(cls, message, "Name it once: is it a standstill when it is 0?")
        if fields.list_of(field) is not None:
            message = f"motion_fields names '{field}' in a list, and only positions can stand in one."
            raise wrong_declaration(cls, message, "Give each velocity a field of its own, or leave it out.")
    for name, its in (("motion_fields", velocities), ("position_fields", positions)):
        for field in its:
            _check_known(cls, fields, field, name)


def check_lists(cls: type, message_type: Any) -> None:
    """Refuse a ``keyed_by`` that names no two lists of its messages."""
    keyed_by = getattr(message_type, "keyed_by", None)
    if not keyed_by or not (isinstance(message_type, type) and issubclass(message_type, BaseModel)):
        return
    texts, lists = text_lists(message_type.model_json_schema()), message_fields(message_type).lists
    for path, names in keyed_by.items():
        for wanted, known, what in ((path, {one.path for one in lists}, "numbers"), (names, texts, "texts")):
            if wanted not in known:
                message = f"keyed_by of {message_type.__name__} names '{wanted}', which is no list of {what}."
                has = f"It has: {', '.join(sorted(known))}." if known else f"It has no list of {what}."
                raise wrong_declaration(cls, message, has)


def check_timeout(cls: type, timeout_s: object, *, has_safe_action: bool) -> None:
    """Refuse a time-out that none can be, and one after which nothing would happen."""
    if isinstance(timeout_s, bool | str):
        raise wrong_declaration(cls, f"timeout_s is {timeout_s!r}, and no number.", "Write seconds, such as 0.5.")
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
            TypeAdapter(ResourceName).validate_python(resource)
        except ValidationError:
            message = f"the lease of '{resource}' can't be taken."
            cure = "Write small letters, digits, - and _, a letter first, 32 at most."
            raise wrong_declaration(cls, message, cure) from None


def check_limits(
    cls: type, fields: MessageFields, limits: object, velocities: Iterable[str], positions: Iterable[str]
) -> None:
    """Refuse limits of fields that its messages don't have, and those that nothing can follow."""
    if not isinstance(limits, Mapping):
        return
    found = []
    for field, bounds in limits.items():
        if not isinstance(bounds, FieldBounds):
            message = f"the limit of '{field}' is a {type(bounds).__name__}."
            raise wrong_declaration(cls, message, "Write FieldBounds(min=…, max=…).")
        _check_known(cls, fields, field, "limits")
        try:
            kind = kind_of(field, bounds, fields, tuple(velocities), tuple(positions))
            found.append(bounds.limit(field, kind))
        except ImpossibleLimit as wrong:
            raise wrong_declaration(cls, f"{wrong}.", f"Cure: {wrong.cure}." if wrong.cure else "Change it.") from None
    for _, message in clashes(found):
        raise wrong_declaration(cls, f"{message}.", "Write limits that can be kept together.")


def _check_known(cls: type, fields: MessageFields, field: str, where: str) -> None:
    if not fields.has(field) and not has_two_names(fields.message_type, field.split(".")):
        message = f"{where} names '{field}', a number that its messages don't have{hint_at(field, fields.names)}"
        raise wrong_declaration(cls, message, f"They have: {', '.join(fields.names)}.")


def _place_of(cls: type) -> str:
    """``file:line`` of the class statement that is being executed."""
    frame = inspect.currentframe()
    assert frame is not None
    while frame.f_globals.get("__name__") != cls.__module__ and frame.f_back is not None:
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"
