"""Inertial sensors over a map of registers: who they are, their units, what they lose, and that they come back."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import pytest

from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_i2c import bno055, bus, icm20948
from mosaic_i2c.bno055 import Bno055, Bno055Configurer
from mosaic_i2c.fake_chips import FakeBno055, FakeChip, FakeIcm20948
from mosaic_i2c.icm20948 import Icm20948, Icm20948Configurer


class OneChipBus:
    """Stands in for smbus2's bus: one chip on it, at one address."""

    def __init__(self, chip: FakeChip, address: int) -> None:
        self.chip, self.address = chip, address
        self.is_open = False

    def __call__(self, source: str) -> OneChipBus:
        if source != "/dev/i2c-1":
            raise FileNotFoundError(2, "No such file or directory")
        self.is_open = True
        return self

    def __enter__(self) -> OneChipBus:
        return self

    def __exit__(self, *error: object) -> None:
        self.is_open = False

    def read_i2c_block_data(self, address: int, register: int, count: int) -> list[int]:
        assert count <= 32
        return list(self._at(address).read(register, count))

    def write_byte_data(self, address: int, register: int, value: int) -> None:
        self._at(address).write(register, value)

    def _at(self, address: int) -> FakeChip:
        if address != self.address:
            raise OSError(121, "Remote I/O error")
        return self.chip


@pytest.fixture
def bno(monkeypatch: pytest.MonkeyPatch) -> Iterator[OneChipBus]:
    found = OneChipBus(FakeBno055(), 0x28)
    monkeypatch.setattr(bus, "SMBus", found)
    yield found
    assert not found.is_open


@pytest.fixture
def icm(monkeypatch: pytest.MonkeyPatch) -> Iterator[OneChipBus]:
    found = OneChipBus(FakeIcm20948(), 0x69)
    monkeypatch.setattr(bus, "SMBus", found)
    yield found
    assert not found.is_open


def bno_at(**params: Any) -> Bno055:
    return build(Bno055Configurer, params=params)


def icm_at(**params: Any) -> Icm20948:
    return build(Icm20948Configurer, params=params)


def test_a_bno055_tells_gravity_rotation_orientation_and_calibration_in_our_units(bno: OneChipBus) -> None:
    imu = bno_at()
    first, second = collect(imu, 2)
    assert (second.linear_acceleration.z, second.angular_velocity.z) == (9.81, 0.5)
    assert first.orientation is not None
    assert second.orientation is not None
    assert 2 * math.atan2(second.orientation.z, second.orientation.w) == pytest.approx(0.01, abs=2e-4)
    said = (second.calibration_system, second.calibration_gyroscope, second.calibration_accelerometer)
    assert (*said, second.calibration_magnetometer) == (3, 3, 3, 1)
    assert (bno055.MODE, 0x0C) in bno.chip.writes
    assert fake_host(imu).clock.now_s == pytest.approx(1000 + 2 * bno055.MODE_CHANGE_S + 0.02)


def test_a_bno055_without_compass_is_set_so(bno: OneChipBus) -> None:
    collect(bno_at(mode="imu"), 1)
    assert bno.chip.writes[-1] == (bno055.MODE, 0x08)


@pytest.mark.parametrize(("dps", "g"), [(250, 2), (500, 4), (1000, 8), (2000, 16)])
def test_an_icm20948_measures_the_same_in_every_range(icm: OneChipBus, dps: int, g: int) -> None:
    (message,) = collect(icm_at(gyroscope_range_dps=dps, acceleration_range_g=g), 1)
    assert message.linear_acceleration.z == pytest.approx(9.80665)
    assert message.angular_velocity.z == pytest.approx(0.5, abs=0.001)
    assert message.orientation is None
    assert icm.chip.banks[2][icm20948.ACCELERATION_CONFIG] & 1


@pytest.mark.parametrize("make", [bno_at, icm_at])
def test_a_sensor_that_is_mounted_otherwise_is_told_of_the_robot(make: Callable[..., Any]) -> None:
    (message,) = collect(make(source="fake", axes=["z", "x", "y"], frame_id="imu"), 1)
    assert message.linear_acceleration.x == pytest.approx(9.81, abs=0.01)
    assert message.linear_acceleration.z == pytest.approx(0)
    assert message.frame_id == "imu"


def test_another_chip_at_the_address_is_named(bno: OneChipBus, monkeypatch: pytest.MonkeyPatch) -> None:
    bno.chip.banks[0][0] = 0x55
    with pytest.raises(DeviceGone, match=r"0x28 is no BNO055, its id is 0x55"):
        collect(bno_at(), 1)
    monkeypatch.setattr(bus, "SMBus", OneChipBus(bno.chip, 0x69))
    with pytest.raises(DeviceGone, match=r"0x69 is no ICM-20948, its id is 0x55"):
        collect(icm_at(), 1)


def test_no_chip_and_no_bus_are_told_with_place_and_cure(bno: OneChipBus) -> None:
    with pytest.raises(DeviceGone, match=r"/dev/i2c-1, address 0x29: Remote I/O error; is it wired"):
        collect(bno_at(address=0x29), 1)
    with pytest.raises(DeviceGone, match="/dev/i2c-7, address 0x28: No such file"):
        collect(bno_at(source="/dev/i2c-7"), 1)


@pytest.mark.parametrize("kind", ["bno", "icm"])
def test_a_sensor_that_is_away_for_thirty_seconds_is_gone_and_set_up_anew_when_it_returns(
    kind: str, request: pytest.FixtureRequest
) -> None:
    line: OneChipBus = request.getfixturevalue(kind)
    imu: Any = bno_at() if kind == "bno" else icm_at()
    with closing(iter(imu.messages())) as messages:
        next(messages)
        line.chip.is_plugged_in = False
        with pytest.raises(DeviceGone, match="Remote I/O error"):
            next(messages)
    for _ in range(6):
        fake_host(imu).clock.advance(5.0)
        with pytest.raises(DeviceGone):
            collect(imu, 1)
    line.chip = FakeBno055() if kind == "bno" else FakeIcm20948()
    assert collect(imu, 1)[0].linear_acceleration.z > 9


def test_one_that_lost_its_settings_by_a_break_of_its_power_is_set_up_anew(bno: OneChipBus) -> None:
    imu = bno_at()
    with closing(iter(imu.messages())) as messages:
        next(messages)
        bno.chip.banks[0][bno055.MODE] = 0
        with pytest.raises(DeviceGone, match="lost its settings"):
            next(messages)
    assert len(collect(imu, 2)) == 2


def test_an_icm20948_that_fell_asleep_is_set_up_anew(icm: OneChipBus) -> None:
    imu = icm_at()
    with closing(iter(imu.messages())) as messages:
        next(messages)
        icm.chip.banks[0][icm20948.POWER] = 0x41
        with pytest.raises(DeviceGone, match="lost its settings"):
            next(messages)
    assert len(collect(imu, 2)) == 2


def test_an_orientation_that_is_none_is_left_out_and_counted(bno: OneChipBus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bno.chip, "before_read", lambda register: None)
    imu = bno_at()
    assert collect(imu, within_s=0.2) == []
    assert fake_host(imu).losses["refused"] >= 5


@pytest.mark.parametrize("params", [{"source": "i2c"}, {"axes": ["x", "x", "z"]}, {"address": 0x10}, {"rate_hz": 0}])
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any]) -> None:
    for make in (bno_at, icm_at):
        with pytest.raises(ConfigError):
            make(**params)
