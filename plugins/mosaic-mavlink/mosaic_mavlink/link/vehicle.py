"""Keeps what one vehicle last told, and what it is to be sent again and again. Without clock, socket or thread of its
own: the link's thread calls :meth:`Vehicle.hear` and :meth:`Vehicle.tick`; the rest may be called on any.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.messages import wall_time_us
from mosaic_mavlink.link.codec import named
from mosaic_mavlink.link.firmware import FirmwareQuestion
from mosaic_mavlink.link.flight_modes import VehicleClass, mode_name, ordered_mode, vehicle_class
from mosaic_mavlink.link.mode_insistence import ModeInsistence
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.status_texts import StatusTexts
from mosaic_mavlink.link.wanted_rates import WantedRates

_log = logging.getLogger(__name__)

INBOX_MESSAGES = 512
REPEAT_S = 0.2
"""A velocity is said again so often: PX4 wants two a second, ArduPilot one in three seconds."""
_BY_ID = {"DISTANCE_SENSOR", "BATTERY_STATUS"}
"""Several devices send these: each has its own latest one."""


@dataclass(frozen=True, slots=True)
class Heard:
    """One message, when it came, and how many of its kind came before."""

    message: Any
    at_s: float
    stamp_us: int
    number: int


@dataclass(frozen=True, slots=True)
class VehicleFacts:
    """What a heartbeat says."""

    system_id: int
    component_id: int
    kind: VehicleClass
    autopilot: str
    vehicle_type: str
    mode: str
    armed: bool
    status: str
    heard_at_s: float


@dataclass(slots=True)
class _Stream:
    message: OutgoingMessage
    until_s: float
    next_s: float


@dataclass(slots=True, eq=False)
class HeardMessages:
    """What somebody waits for: messages of some kinds, bounded; what finds no room is lost."""

    kinds: frozenset[str]
    waiting: queue.Queue[Any] = field(default_factory=lambda: queue.Queue(INBOX_MESSAGES))

    def take(self, timeout_s: float) -> Any | None:
        """The next message, or ``None`` when there was none in time."""
        try:
            return self.waiting.get(timeout=max(0.0, timeout_s)) if timeout_s > 0 else self.waiting.get_nowait()
        except queue.Empty:
            return None


class Vehicle:
    """One vehicle of a link. ``system_id`` 0: the first autopilot that is heard, and from then on only that one."""

    def __init__(self, system_id: int, component_id: int, timeout_s: float, own_system_id: int) -> None:
        self.wanted_id = system_id
        self.component_id = component_id
        self.timeout_s = timeout_s
        self._own_id = own_system_id
        self.texts = StatusTexts()
        self.rates = WantedRates()
        self.firmware = FirmwareQuestion()
        self.facts: VehicleFacts | None = None
        self._latest: dict[str, Heard] = {}
        self._inboxes: tuple[HeardMessages, ...] = ()
        self._insistence = ModeInsistence(self._tell)
        self._stream: _Stream | None = None
        self._lock = threading.Lock()

    # -- the link's thread --

    def is_meant(self, system_id: int, component_id: int) -> bool:
        """Whether messages of this sender are this vehicle's."""
        meant = self.wanted_id or (self.facts.system_id if self.facts is not None else 0)
        return component_id == self.component_id and meant in (0, system_id)

    def hear(self, message: Any, now_s: float) -> None:
        """Take a message of this vehicle."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._beat(message, now_s)
        if self.facts is None:
            return
        self._take_up(kind, message, now_s)
        key = f"{kind}:{message.id}" if kind in _BY_ID else kind
        before = self._latest.get(key)
        self._latest[key] = Heard(message, now_s, wall_time_us(), before.number + 1 if before else 1)
        self.rates.heard(kind, now_s)
        for inbox in self._inboxes:
            if kind in inbox.kinds and not inbox.waiting.full():
                inbox.waiting.put_nowait(message)

    def _take_up(self, kind: str, message: Any, now_s: float) -> None:
        """What the vehicle keeps of some kinds besides the message itself."""
        assert self.facts is not None
        if kind == "STATUSTEXT":
            self.texts.hear(message)
        elif kind == "AUTOPILOT_VERSION":
            for text in self.firmware.hear(message, self.facts.kind):
                self._tell(text)
        elif self._is_answer(message, words.MAV_CMD_DO_SET_MODE):
            self._insistence.acknowledged(message.result, self.facts.kind, now_s)

    def _is_answer(self, message: Any, command: int) -> bool:
        """Whether it acknowledges a ``command`` of ours; other ground stations ask too."""
        if message.get_type() != "COMMAND_ACK" or message.command != command:
            return False
        return message.target_system in (0, self._own_id)

    def _tell(self, text: str) -> None:
        """Tell people, in the robot's log and among the vehicle's own texts."""
        _log.warning("vehicle %d: %s", self.facts.system_id if self.facts is not None else self.wanted_id, text)
        self.texts.note("warn", text)

    def _beat(self, message: Any, now_s: float) -> None:
        if message.autopilot == words.MAV_AUTOPILOT_INVALID or message.type == words.MAV_TYPE_GCS:
            return
        kind = vehicle_class(message.autopilot, message.type)
        if self.facts is None or not self.is_present(now_s):
            self.rates.ask_again()  # one that has booted anew has forgotten what it was asked
            self.firmware.ask_again()
        self.facts = VehicleFacts(
            message.get_srcSystem(), message.get_srcComponent(), kind,
            named("MAV_AUTOPILOT", message.autopilot), named("MAV_TYPE", message.type),
            mode_name(kind, message.custom_mode), bool(message.base_mode & words.MAV_MODE_FLAG_SAFETY_ARMED),
            named("MAV_STATE", message.system_status), now_s,
        )  # fmt: skip

    def tick(self, now_s: float) -> list[OutgoingMessage]:
        """What is to be sent now: what is asked for, the mode that is insisted on, the velocity once more."""
        facts = self.facts
        if facts is None or not self.is_present(now_s):
            return []
        asked = (*self.rates.requests(now_s), *self.firmware.requests(facts.kind, now_s))
        return [*asked, *self._insistence.orders(facts.kind, facts.mode, now_s), *self._streamed(now_s)]

    def _streamed(self, now_s: float) -> Iterator[OutgoingMessage]:
        with self._lock:
            one = self._stream
            if one is None or now_s > one.until_s:
                self._stream = None
                return
            if now_s < one.next_s:
                return
            one.next_s = now_s + REPEAT_S
        yield one.message

    # -- any thread --

    def is_present(self, now_s: float) -> bool:
        """Whether its heart beats."""
        return self.facts is not None and now_s - self.facts.heard_at_s <= self.timeout_s

    def latest(self, key: str) -> Heard | None:
        """The newest message of a kind; of some kinds ``KIND:id``."""
        return self._latest.get(key)

    @contextmanager
    def listening(self, kinds: Iterable[str]) -> Iterator[HeardMessages]:
        """Collect messages of these kinds from now on."""
        inbox = HeardMessages(frozenset(kinds))
        with self._lock:
            self._inboxes = (*self._inboxes, inbox)
        try:
            yield inbox
        finally:
            with self._lock:
                self._inboxes = tuple(one for one in self._inboxes if one is not inbox)

    def repeat(self, message: OutgoingMessage, now_s: float, for_s: float) -> None:
        """Say ``message`` again and again for so long; it takes the place of the one before."""
        with self._lock:
            self._stream = _Stream(message, now_s + for_s, now_s + REPEAT_S)

    def insist(self, mode: str, now_s: float, after_s: float = 0.0) -> None:
        """Order a mode ``after_s`` from now, until the vehicle has left the one that it is in, or 10 s are over; its
        replacement where the firmware does not have it."""
        facts = self.facts
        if facts is not None:
            self._insistence.begin(ordered_mode(facts.kind, mode, self.firmware.version), facts.mode, now_s + after_s)

    def give_way(self) -> None:
        """Somebody commands anew: insist on nothing."""
        self._insistence.give_way()

    @property
    def is_insisting(self) -> bool:
        return self._insistence.is_going_on
