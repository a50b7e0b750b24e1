"""The robot's own computer as a sensor."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psutil
import pytest

from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.host_load import HostLoad, HostLoadConfigurer, HostLoadState


def temperatures(**celsius: list[float]) -> dict[str, list[SimpleNamespace]]:
    return {name: [SimpleNamespace(current=value) for value in values] for name, values in celsius.items()}


def reading(**params: Any) -> HostLoadState:
    return collect(build(HostLoadConfigurer, params=params), 1)[0]


def test_readings_are_plausible_and_come_once_per_period() -> None:
    load = build(HostLoadConfigurer, params={"period_s": 2.0})
    started_s = fake_host(load).clock.now_s
    states = collect(load, 3)

    assert fake_host(load).clock.now_s - started_s == pytest.approx(4.1)
    for state in states:
        assert 0 <= state.cpu_percent <= 100
        assert 0 < state.memory_percent <= 100
        assert 0 <= state.disk_percent <= 100
        assert min(state.load_1_min, state.load_5_min, state.load_15_min) >= 0
    assert states[2].uptime_s >= states[0].uptime_s > 0


def test_the_hottest_reading_of_the_processor_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    found = temperatures(nvme=[90.0], coretemp=[41.0, 47.26], acpitz=[20.0])
    monkeypatch.setattr(psutil, "sensors_temperatures", lambda: found, raising=False)

    assert reading().temperature_c == 47.3


def test_a_machine_without_a_sensor_says_null(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(psutil, "sensors_temperatures", lambda: temperatures(coretemp=[]), raising=False)

    assert reading().temperature_c is None


def test_a_system_that_cannot_read_temperatures_says_null(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(psutil, "sensors_temperatures", raising=False)

    assert reading().temperature_c is None


def test_a_misspelt_sensor_is_told_with_those_that_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(psutil, "sensors_temperatures", lambda: temperatures(nvme=[30.0]), raising=False)

    with pytest.raises(DeviceGone, match="no temperature sensor 'nvm'; found: nvme"):
        reading(temperature_sensor="nvm")


def test_a_disk_that_does_not_exist_is_an_error_that_names_it() -> None:
    with pytest.raises(DeviceGone, match="/no/such/disk: No such file or directory; mount it"):
        reading(disk_path="/no/such/disk")


def test_a_disk_that_is_away_for_thirty_seconds_is_gone_and_told_of_again(tmp_path: Path) -> None:
    disk = tmp_path / "usb"
    disk.mkdir()
    load = build(HostLoadConfigurer, params={"disk_path": str(disk)})
    with closing(iter(load.messages())) as messages:
        next(messages)
        disk.rmdir()
        with pytest.raises(DeviceGone, match="usb"):
            next(messages)
    for _ in range(6):
        fake_host(load).clock.advance(5.0)
        with pytest.raises(DeviceGone):
            collect(load, 1)
    disk.mkdir()
    assert len(collect(load, 2)) == 2


def test_what_is_no_temperature_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    found = temperatures(coretemp=[math.nan, 41.0, math.inf], acpitz=[20.0])
    monkeypatch.setattr(psutil, "sensors_temperatures", lambda: found, raising=False)
    assert reading().temperature_c == 41.0
    found["coretemp"][1].current = None
    assert reading().temperature_c == 20.0


def test_it_is_announced_with_units() -> None:
    assert HostLoad.data_type is MosaicDataType.JSON_R2U
    assert HostLoadState.model_json_schema()["properties"]["cpu_percent"]["unit"] == "%"


def test_a_period_that_would_be_a_load_itself_is_refused() -> None:
    with pytest.raises(ConfigError, match="period_s"):
        build(HostLoadConfigurer, params={"period_s": 0.01})
