"""Orders a mode until the vehicle has left the one that it is in, and another one where it refuses. Pure."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.flight_modes import VehicleClass, mode_order, replacement
from mosaic_mavlink.link.outgoing import OutgoingMessage, mode_message

INSIST_S = 0.5
INSIST_FOR_S = 10.0
HEEDED_S = 3.0
"""A vehicle that did not follow for so long is ordered into the replacement of the mode, where there is one."""
_REFUSALS = {words.MAV_RESULT_DENIED, words.MAV_RESULT_UNSUPPORTED, words.MAV_RESULT_FAILED}


@dataclass(slots=True)
class _Wanted:
    mode: str
    while_mode: str
    begins_s: float
    next_s: float
    was_ordered: bool = False


class ModeInsistence:
    """One vehicle. ``begin`` and ``give_way`` on any thread, the rest on the link's."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        """``tell``: takes what people should know."""
        self._tell = tell
        self._lock = threading.Lock()
        self._wanted: _Wanted | None = None

    @property
    def is_going_on(self) -> bool:
        return self._wanted is not None

    def begin(self, mode: str, while_mode: str, begins_s: float) -> None:
        """Order ``mode`` from then on, for as long as the vehicle is in ``while_mode``, and for 10 s at most."""
        with self._lock:
            self._wanted = _Wanted(mode, while_mode, begins_s, begins_s)

    def give_way(self) -> None:
        """Somebody commands anew: insist on nothing."""
        with self._lock:
            self._wanted = None

    def acknowledged(self, result: int, kind: VehicleClass, now_s: float) -> None:
        """The vehicle answers an order of a mode."""
        with self._lock:
            if self._wanted is not None and self._wanted.was_ordered and result in _REFUSALS:
                self._replaced(self._wanted, kind, now_s)

    def orders(self, kind: VehicleClass, mode: str, now_s: float) -> Iterator[OutgoingMessage]:
        """What is to be sent now to a vehicle that is in ``mode``."""
        with self._lock:
            one = self._wanted
            if one is None:
                return
            if mode != one.while_mode:
                self._wanted = None  # it is there, or somebody with a transmitter decided otherwise
                return
            if now_s > one.begins_s + HEEDED_S:
                self._replaced(one, kind, now_s)
            if now_s > one.begins_s + INSIST_FOR_S:
                self._wanted = None
                self._tell(f"it was ordered into {one.mode} for {INSIST_FOR_S:g} s and stays in {mode}")
                return
            if now_s < one.next_s:
                return
            one.next_s, one.was_ordered = now_s + INSIST_S, True
            order = mode_order(kind, one.mode)
        if order is not None:
            yield mode_message(order)

    def _replaced(self, one: _Wanted, kind: VehicleClass, now_s: float) -> None:
        other = replacement(kind, one.mode)
        if other is not None:
            self._tell(f"it does not enter {one.mode}; {other.mode} is ordered instead")
            one.mode, one.begins_s, one.next_s, one.was_ordered = other.mode, now_s, now_s, False
