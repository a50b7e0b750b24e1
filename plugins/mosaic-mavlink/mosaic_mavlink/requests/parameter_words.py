"""The parameter protocol: get, set and list, with retries. Pure.

ArduPilot sends every number as a float; PX4 puts the bytes of whole numbers where the float would be (MAVLink's
"bytewise" encoding).
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.status_texts import printable
from mosaic_mavlink.requests.conversation import Concluded, Conversation, Effect, NotConcluded, ShowProgress

MAX_PARAMETERS = 5000
ASK_AT_ONCE = 10
PROGRESS_EVERY = 25
UNNUMBERED = 0xFFFF
REAL32: int = words.MAV_PARAM_TYPE_REAL32
_WHOLE = {
    words.MAV_PARAM_TYPE_UINT8: "B", words.MAV_PARAM_TYPE_INT8: "b", words.MAV_PARAM_TYPE_UINT16: "H",
    words.MAV_PARAM_TYPE_INT16: "h", words.MAV_PARAM_TYPE_UINT32: "I", words.MAV_PARAM_TYPE_INT32: "i",
}  # fmt: skip
"""``struct`` formats of whole numbers, all of which fit into the four bytes of the float."""
SAME = 1e-6


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """One parameter. ``value``: also NaN or infinite, as the vehicle tells it. ``number``: its ``MAV_PARAM_TYPE``."""

    name: str
    value: float
    number: int

    @property
    def is_whole(self) -> bool:
        return self.number in _WHOLE


def read_value(message: Any, *, bytewise: bool) -> ParameterValue:
    """The parameter of a ``PARAM_VALUE``."""
    value, layout = message.param_value, _WHOLE.get(message.param_type)
    if bytewise and layout is not None:
        value = float(struct.unpack_from(f"<{layout}", struct.pack("<f", value))[0])
    return ParameterValue(printable(message.param_id), value, message.param_type)


def written_value(value: float, number: int, *, bytewise: bool) -> float:
    """What to put into ``param_value``. Raises :class:`ValueError` for a number that the type does not hold."""
    layout = _WHOLE.get(number)
    if layout is None:
        return value
    try:
        packed = struct.pack(f"<{layout}", int(value)) if value == int(value) else None
    except struct.error:
        packed = None
    if packed is None:
        raise ValueError(f"{value:g} is no whole number within its bounds")
    return float(struct.unpack("<f", packed.ljust(4, b"\0"))[0]) if bytewise else value


class GetParameter(Conversation):
    """Asks for one parameter by name."""

    listens: ClassVar[frozenset[str]] = frozenset({"PARAM_VALUE"})

    def __init__(self, name: str, *, bytewise: bool) -> None:
        super().__init__()
        self.what = f"for {name} (is there a parameter of that name?)"
        self.name = name
        self.bytewise = bytewise

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, ("param_request_read", {"param_id": self.name.encode(), "param_index": -1}))

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        if printable(message.param_id) != self.name:
            return []
        return self.known(read_value(message, bytewise=self.bytewise), now_s)

    def known(self, parameter: ParameterValue, now_s: float) -> list[Effect]:
        """The vehicle told the value."""
        return [Concluded([parameter])]


class SetParameter(GetParameter):
    """Asks for one parameter, whose type must be known, and sets it. The vehicle says what it took."""

    def __init__(self, name: str, value: float, *, bytewise: bool) -> None:
        super().__init__(name, bytewise=bytewise)
        self._value = value
        self._is_set = False

    def known(self, parameter: ParameterValue, now_s: float) -> list[Effect]:
        if math.isclose(parameter.value, self._value, rel_tol=SAME, abs_tol=SAME):
            return [Concluded([parameter])]
        if self._is_set:
            kept = f"{self.name} stays {parameter.value:g}: the vehicle did not take {self._value:g}; see its log"
            return [NotConcluded("mavlink.not_set", kept)]
        try:
            value = written_value(self._value, parameter.number, bytewise=self.bytewise)
        except ValueError as error:
            return [NotConcluded("mavlink.not_set", f"{self.name}: {error}")]
        self._is_set = True
        fields = {"param_id": self.name.encode(), "param_value": value, "param_type": parameter.number}
        return self.say(now_s, ("param_set", fields))


class ListParameters(Conversation):
    """Asks for all parameters, then for each that got lost."""

    listens: ClassVar[frozenset[str]] = frozenset({"PARAM_VALUE"})
    what = "for its parameters"

    def __init__(self, *, bytewise: bool) -> None:
        super().__init__()
        self._bytewise = bytewise
        self._found: dict[int, ParameterValue] = {}
        self._total: int | None = None

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, ("param_request_list", {}))

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        if message.param_index == UNNUMBERED or message.param_index in self._found:
            return []
        if message.param_count > MAX_PARAMETERS:
            return [NotConcluded("mavlink.too_many", f"the vehicle has {message.param_count} parameters")]
        self._found[message.param_index] = read_value(message, bytewise=self._bytewise)
        self._total, self._count = message.param_count, 1
        self.deadline_s = now_s + self.patience_s
        if len(self._found) >= message.param_count:
            return [Concluded([one for _, one in sorted(self._found.items())])]
        is_news = len(self._found) % PROGRESS_EVERY == 1
        return [ShowProgress(len(self._found), self._total)] if is_news else []

    def repeated(self, count: int) -> tuple[OutgoingMessage, ...]:
        if self._total is None:
            return self._said
        missing = [place for place in range(self._total) if place not in self._found][:ASK_AT_ONCE]
        return tuple(("param_request_read", {"param_id": b"", "param_index": place}) for place in missing)
