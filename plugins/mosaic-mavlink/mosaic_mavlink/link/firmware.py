"""Asks a vehicle for the version of its firmware where a mode that may be ordered depends on it. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.flight_modes import (
    Firmware,
    LossAction,
    VehicleClass,
    action_mode,
    ordered_mode,
    replacement,
)
from mosaic_mavlink.link.outgoing import OutgoingMessage, command_message

ASK_AGAIN_S = 5.0


class FirmwareQuestion:
    """One vehicle. ``want`` while connectors are made, the rest on the link's thread."""

    def __init__(self) -> None:
        self.version: Firmware | None = None
        self._actions: set[LossAction] = set()
        self._asked_s = float("-inf")

    def want(self, action: LossAction) -> None:
        """Ask, where the mode for this ``action`` is one that not every firmware has."""
        self._actions.add(action)

    def ask_again(self) -> None:
        """The vehicle is new or booted anew."""
        self.version, self._asked_s = None, float("-inf")

    def requests(self, kind: VehicleClass, now_s: float) -> Iterator[OutgoingMessage]:
        """The question, every few seconds until it is answered."""
        modes = filter(None, (action_mode(kind, action) for action in self._actions))
        matters = any(replacement(kind, mode) is not None for mode in modes)
        if matters and self.version is None and now_s - self._asked_s > ASK_AGAIN_S:
            self._asked_s = now_s
            numbers = (words.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0, 0, 0, 0, 0, 0)
            yield command_message(words.MAV_CMD_REQUEST_MESSAGE, numbers)

    def hear(self, message: Any, kind: VehicleClass) -> Iterator[str]:
        """Take an ``AUTOPILOT_VERSION``: what people should know of it."""
        told = (message.flight_sw_version >> 24 & 0xFF, message.flight_sw_version >> 16 & 0xFF)
        if told in ((0, 0), self.version):  # zero: it does not say
            return
        self.version = told
        for action in sorted(self._actions):
            mode = action_mode(kind, action)
            ordered = ordered_mode(kind, mode, told) if mode is not None else mode
            if ordered != mode:
                has = f"firmware {told[0]}.{told[1]} of this {kind} has no {mode}"
                yield f"{has}: on_loss: {action} orders {ordered}"
