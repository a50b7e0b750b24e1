"""An arm whose turns a test takes on the fake clock, on a bus that can fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import pytest

from mosaic_arm.calibration import MotorCalibration
from mosaic_arm.params import ArmParams
from mosaic_arm.servos import serial_line
from mosaic_arm.servos.bus import MotorReading
from mosaic_arm.servos.simulated_bus import SimulatedBus
from mosaic_arm.shared_arm import KeptArm, shared_key
from mosaic_core import DeviceGone, Shared
from mosaic_core.testing import FakeClock


class FailingBus:
    """A simulated bus that vanishes, and whose motors fall silent, on command."""

    def __init__(self, joints: Sequence[MotorCalibration], clock: FakeClock) -> None:
        self.within = SimulatedBus(joints, lambda: clock.now_s)
        self.is_gone = False
        self.silent: set[int] = set()
        self.in_the_way: dict[int, int] = {}
        """How low a motor gets, however hard it presses, in ticks."""
        self.not_there: list[int] = []
        self.offsets: dict[int, int] = {}
        self.faults: dict[int, tuple[str, ...]] = {}
        self.temperatures: dict[int, float] = {}
        self.told: list[tuple[str, Any]] = []
        self.opened = 0

    def __enter__(self) -> Self:
        self._there()
        self.opened += 1
        self.within.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """It may be opened again."""

    def missing(self) -> list[int]:
        return self.not_there

    def read(self) -> dict[int, MotorReading]:
        self._there()
        found = {motor: one for motor, one in self.within.read().items() if motor not in self.silent}
        return {motor: self._ill(motor, one) for motor, one in found.items()}

    def _ill(self, motor: int, one: MotorReading) -> MotorReading:
        hot = self.temperatures.get(motor, one.temperature_c)
        return MotorReading(
            max(one.ticks, self.in_the_way.get(motor, 0)),
            one.ticks_per_s,
            one.load_percent,
            one.voltage_v,
            hot,
            self.faults.get(motor, ()),
        )

    def write_goals(self, ticks: Mapping[int, int]) -> None:
        self._there()
        self.told.append(("goals", dict(ticks)))
        self.within.write_goals(ticks)

    def set_torque(self, motors: Sequence[int], *, on: bool) -> None:
        self._there()
        self.told.append(("torque", on))
        self.within.set_torque(motors, on=on)

    def limit_torque(self, percent: Mapping[int, float]) -> None:
        self.told.append(("limit", dict(percent)))
        self.within.limit_torque(percent)

    def homing_offsets(self) -> dict[int, int]:
        return self.offsets

    def store_calibration(self, joints: Sequence[MotorCalibration]) -> None:
        self.told.append(("calibration", [one.id for one in joints]))

    def _there(self) -> None:
        if self.is_gone:
            raise DeviceGone("the port is lost")


class ArmOnClock:
    """An arm without a thread: its turns ring on a fake clock, as an alarm."""

    def __init__(self, clock: FakeClock, params: ArmParams) -> None:
        self.clock = clock
        self.bus = FailingBus(list(params.calibrations().values()), clock)
        self.arm = KeptArm(params, self.bus, lambda: clock.now_s)
        self.shared = Shared()
        self.shared.get(shared_key(params), lambda: self.arm)
        self.due_at_s: float | None = clock.now_s
        clock.watch(self)
        clock.advance(0.0)

    def ring(self, now_s: float) -> None:
        self.due_at_s = now_s + max(self.arm.turn(), 1e-3)

    def build(self, configurer: Any, safety: Mapping[str, Any] | None = None, **params: Any) -> Any:
        """A handler of this arm on the same clock."""
        from mosaic_core.testing import build

        arm = self.arm.params.model_dump()
        return build(configurer, params={"arm": arm, **params}, safety=safety, shared=self.shared, clock=self.clock)

    def angle(self, name: str) -> float:
        snapshot = self.arm.snapshot
        assert snapshot is not None
        return snapshot.angles_rad[name]


@pytest.fixture(autouse=True)
def patient_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motors on a busy machine answer late; only who is not there shall be missed."""
    monkeypatch.setattr(serial_line, "QUIET_S", 10.0)


@pytest.fixture
def soon_silent(patient_lines: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests in which somebody does not answer."""
    monkeypatch.setattr(serial_line, "QUIET_S", 0.4)


@pytest.fixture
def on_clock(fake_clock: FakeClock) -> ArmOnClock:
    """The six joints of an SO-101 on the fake clock, open."""
    return ArmOnClock(fake_clock, ArmParams(bus="fake", port="test"))
