"""Refuses values of a handler that are of another kind than the framework reads, or that it can't follow."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.words.catalogue import WIDGET_HINTS, is_widget_hint
from mosaic_core.words.data_type import Delivery, Kind
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import hint_at

_WIDGETS_OF: Mapping[Kind, tuple[str, ...]] = {Kind.VIDEO: ("video",), Kind.AUDIO: ("audio", "push-to-talk")}
_DATA_WIDGETS = tuple(one for one in WIDGET_HINTS if not any(one in its for its in _WIDGETS_OF.values()))


@dataclass(frozen=True, slots=True)
class ValueForm:
    """How a value is written. ``noun``: what a wrong one is not; ``cure``: what to write instead."""

    is_one: Callable[[Any], bool]
    noun: str
    cure: str


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _are_names(value: object) -> bool:
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Collection):
        return False
    return all(isinstance(one, str) for one in value)


_FLAG = ValueForm(lambda value: isinstance(value, bool), "truth value", "Write True or False.")
_FIELDS = ValueForm(_are_names, "tuple of names", 'Write the dotted paths as a tuple, such as ("linear.x",).')
_RUNS = ("always", "watched")
FORMS = {
    "is_for_originals": _FLAG,
    "is_part": _FLAG,
    "runs": ValueForm(_RUNS.__contains__, "time to run", 'Write "always" or "watched".'),
    "requires_lease": _FLAG,
    "takes_observers": _FLAG,
    "motion_fields": _FIELDS,
    "position_fields": _FIELDS,
    "item_names": ValueForm(_are_names, "tuple of names", 'Write them as a tuple, such as ("shoulder", "elbow").'),
    "limits": ValueForm(
        lambda value: isinstance(value, Mapping), "mapping", 'Write {"linear.x": FieldBounds(min=…, max=…)}.'
    ),
    "resource": ValueForm(lambda value: isinstance(value, str), "name of a lease", 'Write a name, such as "arm".'),
    "timeout_s": ValueForm(lambda value: value is None or _is_number(value), "number", "Write seconds, such as 0.5."),
    "at_once": ValueForm(lambda value: _is_number(value) and value >= 1, "number of requests", "Write 1 or more."),
    "answer_within_s": ValueForm(
        lambda value: _is_number(value) and value > 0, "number of seconds", "Write seconds above 0, such as 30.0."
    ),
}


def check_values(cls: type, said: object) -> None:
    """Refuse what ``said``, the class or an instance of it, says in another form than is read. What a property will
    say, only the instance knows."""
    for name, form in FORMS.items():
        value = getattr(said, name, None)
        if hasattr(said, name) and not hasattr(value, "__get__") and not form.is_one(value):
            raise wrong_declaration(cls, f"{name} is {value!r}, and no {form.noun}.", form.cure)


def check_runs(cls: type, bodies: Collection[str]) -> None:
    """Refuse ``runs`` of a class that has none of the ``bodies`` which run."""
    if "runs" in vars(cls) and not any(hasattr(cls, name) for name in bodies):
        message = "runs is set, and it has no body that could run: it waits for what operators send."
        raise wrong_declaration(cls, message, "Remove it.")


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


def check_widget(cls: type, widget: object, kind: Kind) -> None:
    """Refuse the name of a widget that nobody has, and one that shows nothing of this kind."""
    if widget is None or hasattr(widget, "__get__"):
        return
    if not isinstance(widget, str):
        raise wrong_declaration(cls, f"widget is {widget!r}, and no name.", f"There are: {', '.join(WIDGET_HINTS)}.")
    if not is_widget_hint(widget):
        message = f"there is no widget '{widget}'{hint_at(widget, WIDGET_HINTS)}"
        cure = f"There are: {', '.join(WIDGET_HINTS)}; a plugin's own is written as distribution/Name."
        raise wrong_declaration(cls, message, cure)
    fitting = _WIDGETS_OF.get(kind, _DATA_WIDGETS)
    if widget in WIDGET_HINTS and widget not in fitting:
        noun = {Kind.VIDEO: "pictures", Kind.AUDIO: "sound"}.get(kind, "data")
        message = f"the widget '{widget}' shows no {noun}."
        raise wrong_declaration(cls, message, f"Leave `widget` out, or write one of {', '.join(fitting)}.")


def check_sent(cls: type, sends: object) -> None:
    """Refuse a type of what it sends that is none."""
    if sends is not None and not (isinstance(sends, type) and issubclass(sends, BaseModel)):
        message = f"sends is {sends!r}, and no type of messages."
        raise wrong_declaration(cls, message, "Name a subclass of Message, or leave it out.")
