"""Keeps one opening of a bus, until it is lost: who answers, whether the motors are powered, which replies are missing.

The arm's thread alone uses it.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack

from mosaic_arm.arm_joint import ArmJoint, ArmSnapshot
from mosaic_arm.params import ArmParams
from mosaic_arm.servos.bus import MotorReading, ServoBus
from mosaic_core import DeviceGone
from mosaic_core.messages import wall_time_us

SILENT_S = 0.3
"""A motor whose replies are lost for so long is gone: at 100 turns a second that is no noise any more."""
FASTEST_TICKS_PER_S = 8000.0
"""Twelve radians a second: no such servo turns faster, so a reading that says so is noise that has a right checksum by
chance (one of 256 has, of Feetech's)."""
NOISE_TICKS = 100
"""A jump so small does no harm, however short the time."""
FIRST_READS = 10
"""One lost reply in the first turn shall not open the bus again."""


class BusSession:
    """Reads angles and writes goals while the bus is open. Raises :class:`DeviceGone` for whatever fails."""

    def __init__(
        self, bus: ServoBus, params: ArmParams, joints: tuple[ArmJoint, ...], offsets: Mapping[int, int] | None
    ) -> None:
        """``offsets``: what the calibration file says that motors keep; ``None``: there is no file."""
        self._bus = bus
        self._params = params
        self._joints = joints
        self._offsets = offsets
        self._stack: ExitStack | None = None
        self._readings: dict[str, MotorReading] = {}
        self._heard_at_s: dict[str, float] = {}
        self._doubted: dict[str, int] = {}
        self.has_power = False
        self.lost_replies = 0

    @property
    def is_open(self) -> bool:
        return self._stack is not None

    def open(self) -> None:
        """Open the port and see whether everybody is there and calibrated as the file says."""
        with ExitStack() as stack:
            stack.enter_context(self._bus)
            self._check_present()
            self._check_offsets()
            self._readings = self._all_read()
            self._bus.limit_torque({joint.motor: self._params.torque_percent for joint in self._joints})
            self._stack = stack.pop_all()
        self.has_power = False
        self._heard_at_s, self._doubted = {}, {}

    def _check_present(self) -> None:
        missing = set(self._bus.missing())
        if missing:
            names = ", ".join(f"{one.motor} ({one.name})" for one in self._joints if one.motor in missing)
            cure = "Look at the supply of the arm, the cables from motor to motor, their numbers, `bus` and `baud`."
            raise DeviceGone(f"motors on {self._params.port} do not answer: {names}", cure)

    def _check_offsets(self) -> None:
        """An arm with another one's calibration would go to wrong places."""
        kept = self._bus.homing_offsets() if self._offsets else {}
        for joint in self._joints:
            wanted = (self._offsets or {}).get(joint.motor)
            if wanted is not None and kept.get(joint.motor) != wanted:
                raise DeviceGone(
                    f"motor {joint.motor} ({joint.name}) keeps the offset {kept.get(joint.motor)}, and "
                    f"{self._params.calibration} says {wanted}",
                    f"Write it into the motors: mosaic arm calibrate {self._params.calibration} --write",
                )

    def _all_read(self) -> dict[str, MotorReading]:
        found: dict[int, MotorReading] = {}
        for _ in range(FIRST_READS):
            found |= self._bus.read()
            if len(found) == len(self._joints):
                return {joint.name: found[joint.motor] for joint in self._joints}
        silent = ", ".join(f"{one.motor} ({one.name})" for one in self._joints if one.motor not in found)
        raise DeviceGone(f"motors on {self._params.port} tell no position: {silent}", "Look at their cables.")

    def read(self, now_s: float) -> ArmSnapshot:
        """Where all joints are; one whose reply was lost, or can't be true, is where it was."""
        replies = self._bus.read()
        for joint in self._joints:
            if joint.motor in replies and self._is_possible(joint.name, replies[joint.motor].ticks, now_s):
                self._readings[joint.name] = replies[joint.motor]
                self._heard_at_s[joint.name] = now_s
            else:
                self.lost_replies += 1
        self._check_heard(now_s)
        scales = {joint.name: joint.scale for joint in self._joints}
        return ArmSnapshot(
            at_s=now_s,
            stamp_us=wall_time_us(),
            angles_rad={name: scale.angle_rad(self._readings[name].ticks) for name, scale in scales.items()},
            speeds_radps={name: scale.speed_radps(self._readings[name].ticks_per_s) for name, scale in scales.items()},
            motors=dict(self._readings),
        )

    def _is_possible(self, name: str, ticks: int, now_s: float) -> bool:
        """Whether it may be there, after where it was; what is said twice is believed."""
        most = max(NOISE_TICKS, FASTEST_TICKS_PER_S * (now_s - self._heard_at_s.get(name, now_s)))
        doubted = self._doubted.pop(name, None)
        if abs(ticks - self._readings[name].ticks) <= most:
            return True
        if doubted is not None and abs(ticks - doubted) <= NOISE_TICKS:
            return True
        self._doubted[name] = ticks
        return False

    def _check_heard(self, now_s: float) -> None:
        for joint in self._joints:
            if now_s - self._heard_at_s.setdefault(joint.name, now_s) > SILENT_S:
                cure = "Look at its cable and its supply; a motor that is hot or overloaded may have switched off."
                raise DeviceGone(f"motor {joint.motor} ({joint.name}) does not answer any more", cure)

    def write(self, angles_rad: Mapping[str, float], *, wants_power: bool) -> None:
        """Send goals, and power on or off where that changed: the goals come first, or the arm would jump."""
        if wants_power:
            self._bus.write_goals({joint.motor: self._ticks(joint, angles_rad) for joint in self._joints})
        if wants_power is not self.has_power:
            self._bus.set_torque([joint.motor for joint in self._joints], on=wants_power)
            self.has_power = wants_power

    def _ticks(self, joint: ArmJoint, angles_rad: Mapping[str, float]) -> int:
        return joint.scale.goal_near(angles_rad[joint.name], self._readings[joint.name].ticks)

    def strengthen(self, percent: Mapping[str, float]) -> None:
        """Allow joints so much of ``torque_percent``."""
        share = self._params.torque_percent / 100
        self._bus.limit_torque({one.motor: percent[one.name] * share for one in self._joints if one.name in percent})

    def leave(self) -> None:
        """The robot ends."""
        if self._stack is None:
            return
        try:
            if self._params.on_exit == "release":
                self._bus.set_torque([joint.motor for joint in self._joints], on=False)
        except DeviceGone:
            pass  # it is lost, and holds or falls by itself
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Close the port; the motors keep their goals."""
        stack, self._stack = self._stack, None
        self.has_power = False
        if stack is not None:
            stack.close()
