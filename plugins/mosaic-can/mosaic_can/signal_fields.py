"""Makes fields of messages from the signals of a DBC file: type, unit, meaning and range. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

from cantools.database.can.signal import Signal

from mosaic_can.databases import invalid
from mosaic_core.contract.made_message import MAX_NAME, MadeField
from mosaic_core.contract.params import Message
from mosaic_core.words.limits import MotionKind

_MAX_DESCRIPTION = 200


def field_name(name: str) -> str:
    """The name of a signal or message as a field: itself, but for those that have a meaning of their own here."""
    shown = name.lstrip("_")[:MAX_NAME] or "unnamed"
    return f"{shown}_" if hasattr(Message, shown) or not shown.isidentifier() else shown


def field_names(names: Iterable[str]) -> dict[str, str]:
    """Name → field. Raises :class:`MosaicError` where two would be the same field."""
    found = {name: field_name(name) for name in names}
    fields = list(found.values())
    twice = [name for name, field in found.items() if fields.count(field) > 1]
    if twice:
        raise invalid(f"{' and '.join(twice)} can't be told apart here", "Rename one of them in the DBC file.")
    return found


def bounds_of(signal: Signal) -> tuple[float, float] | None:
    """What may be commanded: the range of the DBC file, as far as the frame can carry it. ``None``: any float."""
    low, high = _carried(signal)
    if signal.minimum is not None:
        low = max(low, signal.minimum) if low is not None else signal.minimum
    if signal.maximum is not None:
        high = min(high, signal.maximum) if high is not None else signal.maximum
    return None if low is None or high is None else (float(low), float(high))


def _carried(signal: Signal) -> tuple[float | None, float | None]:
    """The physical values of the least and the greatest number that fits into its bits."""
    if signal.is_float:
        return None, None
    half = 1 << (signal.length - 1)
    raw = (-half, half - 1) if signal.is_signed else (0, 2 * half - 1)
    low, high = sorted(number * signal.scale + signal.offset for number in raw)
    return low, high


def is_flag(signal: Signal) -> bool:
    """Whether it is one bit that means yes or no."""
    return (signal.length, signal.is_signed, signal.scale, signal.offset, signal.choices) == (1, False, 1, 0, None)


def _is_whole(signal: Signal) -> bool:
    return not signal.is_float and float(signal.scale).is_integer() and float(signal.offset).is_integer()


def read_field(signal: Signal) -> MadeField:
    """What is read from the bus; it is ``None`` until it was heard."""
    kind: Any = str if signal.choices else bool if is_flag(signal) else int if _is_whole(signal) else float
    return MadeField(kind | None, signal.unit or None, _told(signal), default=None)


def read_value(signal: Signal, value: Any) -> Any:
    """``value`` as cantools decodes it, in the type of :func:`read_field`."""
    return str(value) if signal.choices else bool(value) if is_flag(signal) else value


def command_field(signal: Signal, kind: MotionKind | None) -> MadeField:
    """What is commanded; all of it must be there."""
    if signal.choices:
        names = tuple(str(choice) for choice in signal.choices.values())
        return MadeField(Literal[names], None, _told(signal))
    if is_flag(signal):
        return MadeField(bool, None, _told(signal))
    low, high = bounds_of(signal) or (None, None)
    number = float if kind or not _is_whole(signal) else int
    return MadeField(number, signal.unit or None, _told(signal), kind, low, high)


def _told(signal: Signal) -> str:
    words = [signal.comment or ""]
    if signal.choices:
        words.append(f"One of {', '.join(map(str, signal.choices.values()))}.")
    return " ".join(word for word in words if word)[:_MAX_DESCRIPTION]
