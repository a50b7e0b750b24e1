"""Makes what a vehicle is sent. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.flight_modes import ModeOrder

OutgoingMessage: TypeAlias = tuple[str, dict[str, Any]]
"""A message by its name in small letters, and its fields without the target."""


def command_message(command: int, params: Iterable[float], confirmation: int = 0) -> OutgoingMessage:
    """A ``COMMAND_LONG`` with seven params."""
    named_params = {f"param{place}": float(value) for place, value in enumerate(params, 1)}
    return "command_long", {"command": command, "confirmation": confirmation, **named_params}


def mode_message(order: ModeOrder) -> OutgoingMessage:
    """The command that enters a mode."""
    numbers = (order.base, order.custom, order.sub, 0, 0, 0, 0)
    return command_message(words.MAV_CMD_DO_SET_MODE, numbers)
