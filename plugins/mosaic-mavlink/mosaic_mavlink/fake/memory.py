"""The parameters and the mission of a vehicle that is made up, and their protocols. Pure."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.outgoing import OutgoingMessage

REAL32, INT32 = words.MAV_PARAM_TYPE_REAL32, words.MAV_PARAM_TYPE_INT32
MAX_ITEMS = 200
_ITEM_FIELDS = (
    "seq", "frame", "command", "current", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z",
)  # fmt: skip


class FakeParameters:
    """A few parameters. ``bytewise``: whole numbers travel as their bytes, as PX4 has it, not as a float."""

    def __init__(self, *, bytewise: bool) -> None:
        self._bytewise = bytewise
        self.values: dict[str, tuple[float, int]] = {
            "WPNAV_SPEED": (500.0, REAL32), "FENCE_ENABLE": (0.0, INT32), "RTL_ALT": (1500.0, INT32),
            "BATT_LOW_VOLT": (10.5, REAL32), "SYSID_MYGCS": (255.0, INT32),
        }  # fmt: skip
        self.to_lose: set[int] = set()
        """Indexes that get lost the next time that the whole list is told."""

    def hear(self, message: Any) -> Iterator[OutgoingMessage]:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            lost, self.to_lose = self.to_lose, set()
            yield from (self._value(name) for place, name in enumerate(self.values) if place not in lost)
        elif kind == "PARAM_REQUEST_READ":
            name = message.param_id if message.param_index < 0 else [*self.values][message.param_index]
            if name in self.values:
                yield self._value(name)
        elif kind == "PARAM_SET" and message.param_id in self.values:
            number = self.values[message.param_id][1]
            self.values[message.param_id] = (self._decoded(message.param_value, number), number)
            yield self._value(message.param_id)

    def _value(self, name: str) -> OutgoingMessage:
        value, number = self.values[name]
        if self._bytewise and number == INT32:
            value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return "param_value", {
            "param_id": name.encode(), "param_value": value, "param_type": number, "param_count": len(self.values),
            "param_index": [*self.values].index(name),
        }  # fmt: skip

    def _decoded(self, value: float, number: int) -> float:
        if self._bytewise and number == INT32:
            return float(struct.unpack("<i", struct.pack("<f", value))[0])
        return value


class FakeMission:
    """A mission: what was uploaded comes down again."""

    def __init__(self) -> None:
        self.items: list[dict[str, Any]] = []
        self._coming: list[dict[str, Any]] = []
        self._expected = 0
        self.to_refuse = 0
        """A ``MAV_MISSION_RESULT`` with which the next upload ends."""

    def hear(self, message: Any) -> Iterator[OutgoingMessage]:
        match message.get_type():
            case "MISSION_COUNT":
                yield from self._begin(message.count)
            case "MISSION_ITEM_INT":
                yield from self._take(message)
            case "MISSION_REQUEST_LIST":
                yield "mission_count", {"count": len(self.items)}
            case "MISSION_REQUEST_INT" if message.seq < len(self.items):
                yield "mission_item_int", self.items[message.seq]
            case "MISSION_CLEAR_ALL":
                self.items = []
                yield "mission_ack", {"type": words.MAV_MISSION_ACCEPTED}

    def _begin(self, count: int) -> Iterator[OutgoingMessage]:
        self._coming, self._expected = [], count
        if self.to_refuse or count > MAX_ITEMS:
            result, self.to_refuse = self.to_refuse or words.MAV_MISSION_NO_SPACE, 0
            yield "mission_ack", {"type": result}
        else:
            yield "mission_request_int", {"seq": 0}

    def _take(self, message: Any) -> Iterator[OutgoingMessage]:
        if message.seq == len(self._coming) < self._expected:
            self._coming.append({name: getattr(message, name) for name in _ITEM_FIELDS})
        if len(self._coming) < self._expected:
            yield "mission_request_int", {"seq": len(self._coming)}
        else:
            self.items = list(self._coming)
            yield "mission_ack", {"type": words.MAV_MISSION_ACCEPTED}
