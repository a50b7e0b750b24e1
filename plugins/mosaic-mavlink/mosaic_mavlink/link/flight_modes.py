"""Names the flight modes of autopilots, and says which of them fly by velocities, which by sticks, and which hold, land
or return. Pure.

ArduPilot has a list of modes for each class of vehicle (the enums ``COPTER_MODE`` and others of its dialect), PX4 a
main and a sub mode for all (``px4_custom_mode.h``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as words

VehicleClass: TypeAlias = Literal["copter", "plane", "rover", "sub", "px4", "unknown"]
LossAction: TypeAlias = Literal["hold", "rtl", "land", "none"]

_PX4_MODES = {
    "MANUAL": (1, 0), "ALTCTL": (2, 0), "POSCTL": (3, 0), "READY": (4, 1), "TAKEOFF": (4, 2), "HOLD": (4, 3),
    "MISSION": (4, 4), "RTL": (4, 5), "LAND": (4, 6), "FOLLOW": (4, 8), "PRECLAND": (4, 9), "ACRO": (5, 0),
    "OFFBOARD": (6, 0), "STABILIZED": (7, 0),
}  # fmt: skip
_SPOKEN = {"FLY_BY_WIRE_A": "FBWA", "FLY_BY_WIRE_B": "FBWB"}
_CLASS_OF_TYPE: dict[int, VehicleClass] = {
    **dict.fromkeys((2, 3, 4, 13, 14, 15, 29, 35), "copter"),
    **dict.fromkeys((1, 16, 19, 20, 21, 22, 23, 24, 25), "plane"),
    **dict.fromkeys((10, 11), "rover"),
    12: "sub",
}
"""``MAV_TYPE`` to the firmware whose list of modes counts."""
_ENUMS: dict[VehicleClass, str] = {
    "copter": "COPTER_MODE", "plane": "PLANE_MODE", "rover": "ROVER_MODE", "sub": "SUB_MODE",
}  # fmt: skip
_GUIDED: dict[VehicleClass, str] = {"px4": "OFFBOARD"}
_ACTIONS: dict[VehicleClass, dict[LossAction, str]] = {
    "copter": {"hold": "BRAKE", "rtl": "RTL", "land": "LAND"},
    "plane": {"hold": "LOITER", "rtl": "RTL", "land": "AUTOLAND"},
    "rover": {"hold": "HOLD", "rtl": "RTL"},
    "sub": {"hold": "POSHOLD", "rtl": "SURFACE", "land": "SURFACE"},
    "px4": {"hold": "HOLD", "rtl": "RTL", "land": "LAND"},
}
_STICKS: dict[VehicleClass, frozenset[str]] = {
    "copter": frozenset({"ALT_HOLD", "LOITER", "POSHOLD", "FLOWHOLD"}),
    "plane": frozenset({"FBWA", "FBWB", "CRUISE", "QHOVER", "QLOITER"}),
    "rover": frozenset({"MANUAL", "ACRO", "STEERING", "SIMPLE"}),
    "sub": frozenset({"MANUAL", "STABILIZE", "ALT_HOLD", "POSHOLD", "ACRO"}),
    "px4": frozenset({"ALTCTL", "POSCTL", "MANUAL"}),
}
"""Modes in which centred sticks are harmless. A copter in STABILIZE holds no height by itself, so it is not here."""

Firmware: TypeAlias = tuple[int, int]
"""Major and minor version, as ``AUTOPILOT_VERSION`` tells them."""


@dataclass(frozen=True, slots=True)
class Replacement:
    """The mode that is ordered where the firmware is older than ``since``, and where it refuses the other one."""

    mode: str
    since: Firmware


_REPLACEMENTS: dict[tuple[VehicleClass, str], Replacement] = {("plane", "AUTOLAND"): Replacement("RTL", (4, 7))}


@dataclass(frozen=True, slots=True)
class ModeOrder:
    """The params of ``MAV_CMD_DO_SET_MODE``: base mode, custom mode, custom sub mode."""

    custom: int
    sub: int = 0
    base: int = words.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def vehicle_class(autopilot: int, mav_type: int) -> VehicleClass:
    """Whose modes a vehicle has, by the ``autopilot`` and ``type`` of its heartbeat."""
    if autopilot == words.MAV_AUTOPILOT_PX4:
        return "px4"
    if autopilot == words.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return _CLASS_OF_TYPE.get(mav_type, "unknown")
    return "unknown"


@cache
def _ardupilot_modes(kind: VehicleClass) -> dict[str, int]:
    prefix = _ENUMS.get(kind, "")
    entries = words.enums.get(prefix, {}).items()
    plain = {entry.name.removeprefix(f"{prefix}_"): number for number, entry in entries}
    return {_SPOKEN.get(name, name): number for name, number in plain.items() if name != "ENUM_END"}


def modes_of(kind: VehicleClass) -> tuple[str, ...]:
    """The names of all modes, as people write them."""
    return tuple(sorted(_PX4_MODES if kind == "px4" else _ardupilot_modes(kind)))


def mode_name(kind: VehicleClass, custom_mode: int) -> str:
    """The name of the ``custom_mode`` of a heartbeat; one that is not known is ``mode 123``."""
    if kind == "px4":
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        names = (name for name, one in _PX4_MODES.items() if one in ((main, sub), (main, 0)))
    else:
        names = (name for name, number in _ardupilot_modes(kind).items() if number == custom_mode)
    return next(names, f"mode {custom_mode}")


def mode_order(kind: VehicleClass, name: str) -> ModeOrder | None:
    """What to order for the mode ``name``; ``None``: this vehicle has none of that name."""
    if kind == "px4":
        found = _PX4_MODES.get(name)
        return ModeOrder(*found) if found is not None else None
    number = _ardupilot_modes(kind).get(name)
    return ModeOrder(number) if number is not None else None


def guided_mode(kind: VehicleClass) -> str:
    """The mode in which a vehicle follows velocities from outside."""
    return _GUIDED.get(kind, "GUIDED")


def follows_velocities(kind: VehicleClass) -> bool:
    """Whether its guided mode heeds velocities: planes of ArduPilot drop them without a word."""
    return kind != "plane"


def stick_modes(kind: VehicleClass) -> frozenset[str]:
    """The modes in which it follows sticks, and stays where it is when they are let go."""
    return _STICKS.get(kind, frozenset())


def action_mode(kind: VehicleClass, action: LossAction) -> str | None:
    """The mode for an action on loss; ``None``: this vehicle knows no such thing."""
    return _ACTIONS.get(kind, {}).get(action)


def replacement(kind: VehicleClass, mode: str) -> Replacement | None:
    """What is ordered where this vehicle does not have ``mode``; ``None``: every firmware has it."""
    return _REPLACEMENTS.get((kind, mode))


def ordered_mode(kind: VehicleClass, mode: str, firmware: Firmware | None) -> str:
    """What to order for ``mode``: its replacement where the firmware is known to be too old."""
    other = replacement(kind, mode)
    return other.mode if other is not None and firmware is not None and firmware < other.since else mode
