"""The robot's battery: a lithium pack that motion drains and the dock fills. Pure."""

from __future__ import annotations

from dataclasses import dataclass

CAPACITY_WH = 60.0
IDLE_W = 3.0
PER_SPEED_W = 22.0
"""Rolling resistance: watts per metre per second."""
PER_TURN_W = 3.0
PER_ACCELERATION_W = 6.0
CHARGER_W = 120.0
FULL_V, EMPTY_V = 25.2, 20.4
INTERNAL_OHM = 0.06
LOW_PERCENT = 5.0
LOW_SPEED_MPS = 0.25
"""Nearly empty, the robot creeps: enough to reach the dock, so that a forgotten demo can still be driven."""


@dataclass(frozen=True, slots=True)
class Battery:
    """The battery of the simulated robot. ``current_a`` flows out of the pack when positive, into it when negative."""

    percent: float = 92.0
    voltage_v: float = 24.8
    current_a: float = 0.0
    is_charging: bool = False


def drained(
    battery: Battery, *, speed_mps: float, turn_radps: float, acceleration_mps2: float, is_docked: bool, dt_s: float
) -> Battery:
    """The battery ``dt_s`` later."""
    load_w = (
        IDLE_W
        + PER_SPEED_W * abs(speed_mps)
        + PER_TURN_W * abs(turn_radps)
        + PER_ACCELERATION_W * abs(acceleration_mps2)
    )
    is_charging = is_docked and battery.percent < 100.0
    if is_docked:
        load_w -= min(CHARGER_W, load_w) if battery.percent >= 100.0 else CHARGER_W
    percent = battery.percent - load_w * dt_s / 3600.0 / CAPACITY_WH * 100.0
    percent = min(100.0, max(0.0, percent))
    open_circuit_v = EMPTY_V + (FULL_V - EMPTY_V) * percent / 100.0
    current_a = load_w / open_circuit_v
    return Battery(percent, open_circuit_v - current_a * INTERNAL_OHM, current_a, is_charging)


def speed_limit_mps(battery: Battery) -> float:
    """How fast the motors may turn the robot forward at this charge."""
    return LOW_SPEED_MPS if battery.percent < LOW_PERCENT else float("inf")
