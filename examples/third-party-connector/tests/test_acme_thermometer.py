"""The thermometer, without a thermometer and without waiting."""

from __future__ import annotations

from pathlib import Path

import pytest
from acme_workbench.thermometer import ThermometerConfigurer

from mosaic_core import ConfigError, DeviceGone
from mosaic_core.testing import build, collect, fake_host


def test_it_reads_degrees_once_per_period(tmp_path: Path) -> None:
    file = tmp_path / "temp"
    file.write_text("42500\n")
    thermometer = build(ThermometerConfigurer, params={"path": str(file), "period_s": 60})
    start_s = fake_host(thermometer).clock.now_s

    first, second = collect(thermometer, 2)

    assert (first.temperature_c, second.temperature_c) == (42.5, 42.5)
    assert fake_host(thermometer).clock.now_s - start_s == 60


def test_a_missing_sensor_ends_the_body_so_that_the_robot_tries_again(tmp_path: Path) -> None:
    thermometer = build(ThermometerConfigurer, params={"path": str(tmp_path / "none")})
    with pytest.raises(DeviceGone, match="No such file"):
        collect(thermometer, 1)


def test_a_typo_in_the_params_gets_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="did you mean 'period_s'"):
        build(ThermometerConfigurer, params={"perid_s": 2})
