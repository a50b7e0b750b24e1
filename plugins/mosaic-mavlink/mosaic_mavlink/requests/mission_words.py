"""The mission protocol: upload, download and clear, with retries and cancelling. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.codec import named
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.requests.conversation import (
    Concluded,
    Conversation,
    Effect,
    NotConcluded,
    SendMessage,
    ShowProgress,
)

MAX_ITEMS = 1000
CANCELLED: OutgoingMessage = ("mission_ack", {"type": words.MAV_MISSION_OPERATION_CANCELLED})
DEGREE_E7 = 1e7


@dataclass(frozen=True, slots=True)
class MissionStep:
    """One item of a mission. ``x`` and ``y``: degrees where the frame is global, else metres or whatever it means."""

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: float
    y: float
    z: float
    autocontinue: bool = True

    def message(self, place: int) -> OutgoingMessage:
        """As a ``MISSION_ITEM_INT``, whose places are whole numbers."""
        factor = item_factor(self.frame)
        numbers = {f"param{at}": value for at, value in enumerate(self.params, 1)}
        return "mission_item_int", {
            "seq": place, "frame": self.frame, "command": self.command, "current": int(place == 0),
            "autocontinue": int(self.autocontinue), **numbers,
            "x": round(self.x * factor), "y": round(self.y * factor), "z": self.z,
        }  # fmt: skip


def item_factor(frame: int) -> float:
    """What ``x`` and ``y`` of a ``MISSION_ITEM_INT`` are multiplied with."""
    local = (words.MAV_FRAME_LOCAL_NED, words.MAV_FRAME_LOCAL_ENU, words.MAV_FRAME_LOCAL_OFFSET_NED)
    return 1.0 if frame == words.MAV_FRAME_MISSION else 1e4 if frame in local else DEGREE_E7


def read_step(message: Any) -> MissionStep:
    """The item of a ``MISSION_ITEM_INT``, or of the older ``MISSION_ITEM``."""
    factor = item_factor(message.frame) if message.get_type() == "MISSION_ITEM_INT" else 1.0
    numbers = (message.param1, message.param2, message.param3, message.param4)
    place = (message.x / factor, message.y / factor, message.z)
    return MissionStep(message.command, message.frame, numbers, *place, bool(message.autocontinue))


def _refusal(result: int) -> list[Effect]:
    if result == words.MAV_MISSION_OPERATION_CANCELLED:
        return [NotConcluded("mavlink.mission_refused", "the vehicle broke it off; does another ground station ask?")]
    said = named("MAV_MISSION_RESULT", result)
    text = said.removeprefix("mav_mission_").replace("_", " ")
    return [NotConcluded("mavlink.mission_refused", f"the vehicle refuses the mission: {text}")]


class UploadMission(Conversation):
    """Announces the items, and hands each over when the vehicle asks for it. The result: how many."""

    listens: ClassVar[frozenset[str]] = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"})
    patience_s: ClassVar[float] = 1.5
    what = "to the mission"

    def __init__(self, steps: tuple[MissionStep, ...]) -> None:
        super().__init__()
        self._steps = steps
        self._handed_over = 0

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, ("mission_count", {"count": len(self._steps)}))

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        if message.get_type() == "MISSION_ACK":
            return self._ended(message.type)
        if message.seq >= len(self._steps):
            return [SendMessage(CANCELLED), *_refusal(words.MAV_MISSION_INVALID_SEQUENCE)]
        self._handed_over = max(self._handed_over, message.seq + 1)
        item = self.say(now_s, self._steps[message.seq].message(message.seq))
        return [*item, ShowProgress(self._handed_over, len(self._steps))]

    def _ended(self, result: int) -> list[Effect]:
        if result != words.MAV_MISSION_ACCEPTED:
            return _refusal(result)
        if self._handed_over < len(self._steps):
            return []  # of an earlier exchange
        return [Concluded(len(self._steps))]

    def cancel(self) -> list[Effect]:
        return [SendMessage(CANCELLED)]


class DownloadMission(Conversation):
    """Asks for each item in turn. The result: the items."""

    listens: ClassVar[frozenset[str]] = frozenset({"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_ACK"})
    patience_s: ClassVar[float] = 1.5
    what = "for its mission"

    def __init__(self) -> None:
        super().__init__()
        self._total: int | None = None
        self._steps: list[MissionStep] = []

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, ("mission_request_list", {}))

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        kind = message.get_type()
        if kind == "MISSION_ACK":
            return _refusal(message.type) if message.type != words.MAV_MISSION_ACCEPTED else []
        if kind == "MISSION_COUNT":
            return self._counted(message.count, now_s)
        if self._total is None or message.seq != len(self._steps):
            return []
        self._steps.append(read_step(message))
        return [ShowProgress(len(self._steps), self._total), *self._next(now_s)]

    def _counted(self, total: int, now_s: float) -> list[Effect]:
        if self._total is not None:
            return []
        if total > MAX_ITEMS:
            return [SendMessage(CANCELLED), NotConcluded("mavlink.too_many", f"the mission has {total} items")]
        self._total = total
        return self._next(now_s)

    def _next(self, now_s: float) -> list[Effect]:
        if len(self._steps) == self._total:
            return [SendMessage(("mission_ack", {"type": words.MAV_MISSION_ACCEPTED})), Concluded(list(self._steps))]
        return self.say(now_s, ("mission_request_int", {"seq": len(self._steps)}))

    def cancel(self) -> list[Effect]:
        return [SendMessage(CANCELLED)]


class ClearMission(Conversation):
    """Forgets the mission. The result: 0."""

    listens: ClassVar[frozenset[str]] = frozenset({"MISSION_ACK"})
    what = "to clear its mission"

    def begin(self, now_s: float) -> list[Effect]:
        return self.say(now_s, ("mission_clear_all", {}))

    def hear(self, message: Any, now_s: float) -> list[Effect]:
        return [Concluded(0)] if message.type == words.MAV_MISSION_ACCEPTED else _refusal(message.type)
