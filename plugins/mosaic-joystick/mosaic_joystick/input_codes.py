"""The words of the kernel's input events that sticks use (``linux/input-event-codes.h``), and which kind has which."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

SYN, KEY, REL, ABS = 0x00, 0x01, 0x02, 0x03
"""Types of events."""
SYN_REPORT, SYN_DROPPED = 0, 3

StickKind = Literal["gamepad", "joystick", "3D mouse"]

BTN_TRIGGER, BTN_GAMEPAD, BTN_DIGI = 0x120, 0x130, 0x140
"""Where the buttons of joysticks and those of gamepads begin, and where both end."""
TRIGGERS = frozenset({0x02, 0x05})
"""The axes ``z`` and ``rz`` of a gamepad; of anything else they go both ways."""
PEDALS = frozenset({0x06, 0x09, 0x0A})
"""Throttle, gas and brake: nought at one end."""
MICE_3D = {0x256F: None, 0x046D: range(0xC603, 0xC62C)}
"""By the USB number of their maker (3Dconnexion, and Logitech before): the numbers of the products, ``None``: all."""
SIX = frozenset(range(6))

AXES = {
    0x00: "x", 0x01: "y", 0x02: "z", 0x03: "rx", 0x04: "ry", 0x05: "rz", 0x06: "throttle", 0x07: "rudder",
    0x08: "wheel", 0x09: "gas", 0x0A: "brake", 0x10: "hat_x", 0x11: "hat_y", 0x12: "hat2_x", 0x13: "hat2_y",
}  # fmt: skip
"""Absolute axes that a stick has; a pad that is touched, a tilt sensor and the like have others too."""
BUTTONS = {
    0x120: "trigger", 0x121: "thumb", 0x122: "thumb2", 0x123: "top", 0x124: "top2", 0x125: "pinkie",
    0x126: "base", 0x127: "base2", 0x128: "base3", 0x129: "base4", 0x12A: "base5", 0x12B: "base6",
    0x130: "south", 0x131: "east", 0x132: "c", 0x133: "north", 0x134: "west", 0x135: "z",
    0x136: "left_bumper", 0x137: "right_bumper", 0x138: "left_trigger", 0x139: "right_trigger",
    0x13A: "select", 0x13B: "start", 0x13C: "mode", 0x13D: "left_stick", 0x13E: "right_stick",
}  # fmt: skip


def kind_of(vendor: int, product: int, axes: Collection[int], rel_axes: Collection[int],
            buttons: Collection[int]) -> StickKind | None:  # fmt: skip
    """Which kind of stick it is; ``None``: none, but a keyboard, a mouse, a touch pad …"""
    products = MICE_3D.get(vendor, ())
    if (products is None or product in products) and (set(axes) >= SIX or set(rel_axes) >= SIX):
        return "3D mouse"
    if any(BTN_GAMEPAD <= one < BTN_DIGI for one in buttons):
        return "gamepad"
    has_stick_buttons = any(BTN_TRIGGER <= one < BTN_GAMEPAD for one in buttons)
    return "joystick" if has_stick_buttons and {0, 1} <= set(axes) else None


def button_name(code: int) -> str:
    """What people call it; of a 3D mouse and of what has no name its number."""
    return BUTTONS.get(code, f"button_{code & 0xFF:02x}")
