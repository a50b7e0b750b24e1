"""Decides what a vehicle does when nobody commands it any more: stand still at once, then hold, return or land.

A mode is ordered only while the vehicle is in the one in which it was commanded: who took over with a transmitter or
another ground station is not overruled.
"""

from __future__ import annotations

import threading

from pydantic import Field

from mosaic_core.contract.handler import Refused
from mosaic_core.words.safety_config import SafePolicy
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.flight_modes import LossAction, action_mode
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.vehicle import VehicleFacts
from mosaic_mavlink.params import VehicleParams

STILL_FOR_S = 5.0
STREAM_MARGIN_S = 0.5
"""Beyond the time-out: were the safety threads to hang, the vehicle would still be told nothing more soon."""
_RELEASED = "safety.timeout"
_AFTER_A_WHILE = {"safety.timeout", "safety.peer_left"}
_HOLDS = {"safety.stop", "safety.lease_lost"}
"""Who says stop wants it to stay where it is: it does not set out for home."""


def not_kept(policy: SafePolicy | None) -> SafePolicy | None:
    """Refuse the policy under which a vehicle would go on for ever. Raises :class:`ValueError`."""
    if policy == "hold":
        raise ValueError("a vehicle that keeps its velocity is gone; use callback (params.on_loss says what follows)")
    return policy


class MotionParams(VehicleParams):
    """A vehicle that is moved, and what it does when it is not any more."""

    on_loss: LossAction = Field(
        default="hold",
        description="Mode after the loss of commands or operator: hold (stay there), rtl (return), land, or none (only "
        "stand still). A vehicle that does not know it takes no commands.",
    )
    on_loss_after_s: float = Field(
        default=2.0,
        ge=0,
        le=30,
        description="It stands still at once; the mode follows so long after, unless commanded.",
    )


class LossGuard:
    """Keeps whether and in which mode a vehicle is commanded. Any thread."""

    def __init__(self, contact: VehicleContact, params: MotionParams, silence_s: float) -> None:
        self._contact = contact
        self._silence_s = silence_s
        self._action: LossAction = params.on_loss
        self._after_s = params.on_loss_after_s
        contact.vehicle.firmware.want(params.on_loss)
        self._lock = threading.Lock()
        self._mode: str | None = None
        self._moves = False
        self._commander = ""

    def check(self, facts: VehicleFacts) -> None:
        """Raises :class:`Refused` for a vehicle that is disarmed or could not do what is wanted on loss."""
        if not facts.armed:
            raise Refused("mavlink.disarmed", "the vehicle is disarmed; ask it to arm first")
        if self._action != "none" and action_mode(facts.kind, self._action) is None:
            raise Refused("mavlink.no_such_action", f"a {facts.kind} knows no {self._action}; choose another on_loss")

    def send(self, command: Outgoing, mode: str, commander: str, *, moves: bool) -> None:
        """Send a command in this ``mode``, again and again until its operator has been silent for too long. Raises
        :class:`Refused` where the link is lost."""
        vehicle = self._contact.vehicle
        with self._lock:
            self._mode, self._moves, self._commander = mode, moves, commander
        vehicle.give_way()
        vehicle.repeat(command, self._contact.now_s(), self._silence_s + STREAM_MARGIN_S)
        if not self._contact.send(command):
            raise Refused("plugin.no_device", "the link is lost; opening it again")

    def is_commander(self, peer_id: str) -> bool:
        """Whether this peer commands now."""
        with self._lock:
            return self._mode is not None and self._commander == peer_id

    def make_safe(self, still: OutgoingMessage, cause: str) -> None:
        """Stand still at once; then the mode for ``cause``. A stick that was let go before is no loss: the vehicle is
        told to stand still on and on, until its operator commands or leaves."""
        vehicle, now_s = self._contact.vehicle, self._contact.now_s()
        with self._lock:
            mode, moves = self._mode, self._moves
            is_released = cause == _RELEASED and not moves
            self._mode = mode if is_released else None
        if mode is None:
            return
        self._contact.send(still)
        vehicle.repeat(still, now_s, float("inf") if is_released else self._after_s + STILL_FOR_S)
        if not is_released:
            self._order(mode, "hold" if cause in _HOLDS else self._action, self._delay_s(cause))

    def _delay_s(self, cause: str) -> float:
        return self._after_s if cause in _AFTER_A_WHILE else 0.0

    def _order(self, mode: str, action: LossAction, after_s: float) -> None:
        facts = self._contact.vehicle.facts
        if facts is None or facts.mode != mode or self._action == "none":
            return
        name = action_mode(facts.kind, action)
        if name is not None:
            self._contact.vehicle.insist(name, self._contact.now_s(), after_s)
