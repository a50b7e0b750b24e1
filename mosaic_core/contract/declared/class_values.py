"""Refuses values of a handler that are of another kind than the framework reads, or that it can't follow."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.media import EncodingParams, PacketCodec
from mosaic_core.contract.sound import SoundEncoding
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


def is_said_later(value: object) -> bool:
    """Whether only an instance knows it: a property, as the class has it. A method says nothing: nobody calls it."""
    return hasattr(value, "__get__") and not callable(value)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _are_names(value: object) -> bool:
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Collection):
        return False
    return all(isinstance(one, str) for one in value)


_FLAG = ValueForm(lambda value: isinstance(value, bool), "truth value", "Write True or False.")
_FIELDS = ValueForm(_are_names, "tuple of names", 'Write the dotted paths as a tuple, such as ("linear.x",).')
_RUNS = ("always", "watched")
_CONTRACT = "mosaic_core.contract."
_OF_THE_CLASS = ("motion_fields", "position_fields")
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
    "at_once": ValueForm(
        lambda value: isinstance(value, int) and value is not True and value >= 1,
        "number of requests",
        "Write 1 or more.",
    ),
    "packet_codec": ValueForm((None, *get_args(PacketCodec)).__contains__, "codec", 'Write "h264", "vp8" or None.'),
    "encoding": ValueForm(
        lambda value: isinstance(value, EncodingParams | SoundEncoding),
        "way to encode",
        "Write EncodingParams(…), of "
        "sound SoundEncoding(…), or derive your Params from it and set self.encoding = params.",
    ),
    "answer_within_s": ValueForm(
        lambda value: _is_number(value) and value > 0, "number of seconds", "Write seconds above 0, such as 30.0."
    ),
}


def check_values(cls: type, said: object) -> None:
    """Refuse what ``said``, the class or an instance of it, says in another form than is read. What a property will
    say, only the instance knows."""
    for name in ("delivery", "widget"):
        _check_read(cls, name, getattr(said, name, None), "Write it as a value.")
    for name, form in FORMS.items():
        if not any(name in vars(base) for base in cls.__mro__ if base.__module__.startswith(_CONTRACT)):
            continue  # a name of the author's own
        value = getattr(said, name)
        _check_read(cls, name, value, form.cure)
        if name in _OF_THE_CLASS and is_said_later(value):
            raise wrong_declaration(cls, f"{name} is a property, and is read of the class.", form.cure)
        if not is_said_later(value) and not form.is_one(value):
            raise wrong_declaration(cls, f"{name} is {value!r}, and no {form.noun}.", form.cure)


def _check_read(cls: type, name: str, value: object, cure: str) -> None:
    if inspect.isroutine(value):
        later = "Where only an instance knows it, put @property above the method, or set it in __init__."
        cure = cure if name in _OF_THE_CLASS else f"{cure} {later}"
        raise wrong_declaration(cls, f"{name} is a method, and is read, not called.", cure)


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
    if not isinstance(delivery, Delivery | DeliveryContract) and not is_said_later(delivery):
        message = f"delivery is {delivery!r}, and no way to deliver."
        ways = ", ".join(f"Delivery.{one.name}" for one in Delivery)
        raise wrong_declaration(cls, message, f"Write one of {ways}, or a DeliveryContract.")


def check_widget(cls: type, widget: object, kind: Kind) -> None:
    """Refuse the name of a widget that nobody has, and one that shows nothing of this kind."""
    if widget is None or is_said_later(widget):
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
    if sends is not None and not is_model(sends):
        message = f"sends is {sends!r}, and no type of messages."
        raise wrong_declaration(cls, message, "Name a subclass of Message, or leave it out.")
