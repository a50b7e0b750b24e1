"""Checks what the author of a handler class declares, at the moment the class is made: nothing that is written there is
ignored silently. An error names the class, its file and line, and the cure.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.message_fields import field_paths, has_two_names
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import MosaicError, hint_at


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


def check_media_delivery(cls: type, delivery: Delivery | DeliveryContract) -> None:
    """Refuse anything but ``latest`` for pictures and sound, which are no messages."""
    mode = delivery if isinstance(delivery, Delivery) else delivery.mode
    if mode not in (None, Delivery.LATEST):
        message = f"pictures and sound are never delivered as {mode}."
        raise wrong_declaration(cls, message, "Leave `delivery` out: their pace and bounds are params.")


def check_fields(cls: type, message_type: Any, velocities: Iterable[str], positions: Iterable[str]) -> None:
    """Refuse fields that its messages don't have, and those that would be both. One that a message may say under two
    names is told when the robot starts."""
    velocities, positions = tuple(velocities), tuple(positions)
    if not (velocities or positions):
        return
    for field in velocities:
        if field in positions:
            message = f"'{field}' is in motion_fields and in position_fields."
            raise wrong_declaration(cls, message, "Name it once: is it a standstill when it is 0?")
    is_model = isinstance(message_type, type) and issubclass(message_type, BaseModel)
    known = field_paths(message_type.model_json_schema()) if is_model else frozenset()
    for field in (*velocities, *positions):
        if known and field not in known and not has_two_names(message_type, field.split(".")):
            name = "motion_fields" if field in velocities else "position_fields"
            message = f"{name} names '{field}', a number that its messages don't have{hint_at(field, known)}"
            raise wrong_declaration(cls, message, f"They have: {', '.join(sorted(known))}.")


def _place_of(cls: type) -> str:
    """``file:line`` of the class statement that is being executed."""
    frame = inspect.currentframe()
    assert frame is not None
    while frame.f_globals.get("__name__") != cls.__module__ and frame.f_back is not None:
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"
