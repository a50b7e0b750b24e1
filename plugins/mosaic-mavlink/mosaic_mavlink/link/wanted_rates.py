"""Asks a vehicle for messages at the rates that connectors want, until they come. Pure."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as words

ASK_AGAIN_S = 5.0
"""An answer got lost, or the vehicle does not know the message: asked so often while it does not come."""
SILENCE_S = 3.0
_SLOWEST_FACTOR = 3.0


def message_number(kind: str) -> int:
    """The id of a message: ``ATTITUDE`` is 30. Raises :class:`AttributeError`."""
    return int(getattr(words, f"MAVLINK_MSG_ID_{kind}"))


class WantedRates:
    """Which messages are wanted how often. ``want`` on any thread, the rest on the link's."""

    def __init__(self) -> None:
        self._period_s: dict[str, float] = {}
        self._asked_s: dict[str, float] = {}
        self._heard_s: dict[str, float] = {}
        self._lock = threading.Lock()

    def want(self, kind: str, period_s: float) -> None:
        """Ask for ``kind`` that often; of several wishes the most frequent counts."""
        with self._lock:
            if period_s < self._period_s.get(kind, float("inf")):
                self._period_s[kind] = period_s
                self._asked_s.pop(kind, None)

    def heard(self, kind: str, now_s: float) -> None:
        """It came."""
        if kind in self._period_s:
            self._heard_s[kind] = now_s

    def ask_again(self) -> None:
        """The vehicle is new or booted anew."""
        with self._lock:
            self._asked_s.clear()

    def requests(self, now_s: float) -> Iterator[tuple[str, dict[str, Any]]]:
        """``SET_MESSAGE_INTERVAL`` for each that was never asked for, or does not come."""
        with self._lock:
            due = [kind for kind, period_s in self._period_s.items() if self._is_due(kind, period_s, now_s)]
            self._asked_s.update(dict.fromkeys(due, now_s))
            periods_us = {kind: self._period_s[kind] * 1e6 for kind in due}
        for kind, period_us in periods_us.items():
            values = (message_number(kind), period_us, 0.0, 0.0, 0.0, 0.0, 0.0)
            numbers = {f"param{place}": float(value) for place, value in enumerate(values, 1)}
            yield "command_long", {"command": words.MAV_CMD_SET_MESSAGE_INTERVAL, "confirmation": 0, **numbers}

    def _is_due(self, kind: str, period_s: float, now_s: float) -> bool:
        asked_s = self._asked_s.get(kind)
        if asked_s is None:
            return True
        patience_s = max(SILENCE_S, _SLOWEST_FACTOR * period_s)
        is_silent = now_s - self._heard_s.get(kind, float("-inf")) > patience_s
        return is_silent and now_s - asked_s > max(ASK_AGAIN_S, patience_s)
