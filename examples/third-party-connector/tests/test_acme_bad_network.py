"""Both connectors over real WebRTC on bad networks: no root, no robot, no second machine."""

from __future__ import annotations

from pathlib import Path

import pytest
from acme_workbench.lamp import LampConfigurer
from acme_workbench.thermometer import ThermometerConfigurer

from mosaic_core.testing import connector, joined, until
from mosaic_core.testing.pytest_plugin import ImpairedNetwork


@pytest.fixture
def led(tmp_path: Path) -> Path:
    (tmp_path / "max_brightness").write_text("200\n")
    (tmp_path / "brightness").write_text("0\n")
    return tmp_path


def brightness(led: Path) -> str:
    return (led / "brightness").read_text()


async def test_the_thermometer_is_read_through_walls(impaired_network: ImpairedNetwork, tmp_path: Path) -> None:
    (tmp_path / "temp").write_text("42500\n")
    thermometer = connector(ThermometerConfigurer, params={"path": str(tmp_path / "temp"), "period_s": 0.05})

    async with joined(thermometer, network=impaired_network("wifi-walls")) as link:
        message = await link.connection.receivable("under_test").next_message()
        assert message.json() == {"temperature_c": 42.5}


async def test_the_lamp_goes_dark_when_the_cable_is_pulled(impaired_network: ImpairedNetwork, led: Path) -> None:
    lamp = connector(LampConfigurer, params={"led": str(led)}, safety={"timeout_s": 0.5})

    async with joined(lamp, network=impaired_network("4g", in_memory=True)) as link:
        pad = link.connection.sendable("under_test")
        await pad.wait_open()
        await until(lambda: pad.send_json({"brightness_percent": 50}) and brightness(led) == "100")
        link.network.cut()
        await until(lambda: brightness(led) == "0")


async def test_operators_behind_another_nat_are_reached_through_a_relay(
    impaired_network: ImpairedNetwork, tmp_path: Path
) -> None:
    (tmp_path / "temp").write_text("1000\n")
    thermometer = connector(ThermometerConfigurer, params={"path": str(tmp_path / "temp"), "period_s": 0.05})

    async with joined(thermometer, network=impaired_network(nat="symmetric")) as link:
        await link.connection.receivable("under_test").next_message()
