"""The ``arm-health`` connector: how the motors are, in words: hot, overloaded, silent, or well."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from mosaic_arm.arm import Arm
from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.arm_joint import ArmSnapshot
from mosaic_arm.params import PartParams
from mosaic_arm.servos.bus import MotorReading
from mosaic_core import DataChannelSendable, Delivery
from mosaic_core.messages import Diagnostic, wall_time_us

Level = Literal["ok", "warn", "error"]
_RANK: dict[Level, int] = {"ok": 0, "warn": 1, "error": 2}


class ArmHealthParams(PartParams):
    period_s: float = Field(default=1.0, ge=0.1, le=60, description="Between two messages.")
    warn_temperature_c: float = Field(default=55.0, gt=0, le=120, description="A motor this hot is told.")
    warn_load_percent: float = Field(default=80.0, gt=0, le=100, description="A motor that bears so much is told.")


class ArmHealth(DataChannelSendable[Diagnostic]):
    """Sends one message about all motors, also while the bus is away."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, arm: Arm, params: ArmHealthParams) -> None:
        super().__init__(label)
        self._arm = arm
        self._its = params

    def messages(self) -> Iterator[Diagnostic]:
        for _ in self.every(self._its.period_s):
            snapshot = self._arm.snapshot
            yield gone(self.label, self._arm) if snapshot is None else self._report(snapshot)

    def _report(self, snapshot: ArmSnapshot) -> Diagnostic:
        found = {name: motor_words(motor, self._its) for name, motor in snapshot.motors.items()}
        level = max((level for level, _ in found.values()), key=_RANK.__getitem__)
        told = [f"{name}: {words}" for name, (one, words) in found.items() if one != "ok"]
        free = ["the motors are off"] if self._arm.is_free else []
        values = {name: figures(motor) for name, motor in list(snapshot.motors.items())[:60]}
        return Diagnostic(
            level=level,
            name=self.label,
            message="; ".join((*told, *free)) or "all motors are well",
            values={**values, "lost replies": str(self._arm.lost_replies)},
            timestamp=snapshot.stamp_us,
        )


def gone(name: str, arm: Arm) -> Diagnostic:
    return Diagnostic(level="stale", name=name, message=arm.gone.message[:4096], timestamp=wall_time_us())


def motor_words(motor: MotorReading, its: ArmHealthParams) -> tuple[Level, str]:
    """How bad it is, and what. A fault is one that the motor's own protection has found."""
    if motor.faults:
        return "error", f"{' and '.join(motor.faults)} ({figures(motor)})"
    hot, loaded = motor.temperature_c >= its.warn_temperature_c, abs(motor.load_percent) >= its.warn_load_percent
    words = [word for word, is_so in (("hot", hot), ("nearly overloaded", loaded)) if is_so]
    return ("warn", f"{' and '.join(words)} ({figures(motor)})") if words else ("ok", "")


def figures(motor: MotorReading) -> str:
    return f"{motor.temperature_c:.0f} °C, {motor.load_percent:.0f} %, {motor.voltage_v:.1f} V"


class ArmHealthConfigurer(ArmConfigurer[ArmHealthParams]):
    """Tells when motors of an arm are hot, overloaded or silent."""

    connector_type = "arm-health"

    def configure(self) -> ArmHealth:
        return ArmHealth(self.label, self.arm, self.params)
