"""The probes of a board, on trees of files like those of the kernel, and with programs that a test puts in the way."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import pytest

from mosaic_core.doctor import board_checks
from mosaic_core.machines.diagnosis.board_verdicts import Board
from mosaic_core.words.finding import Finding

PI_TREE = {
    "proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.5\0",
    "proc/meminfo": "MemTotal:        3885396 kB\nMemFree: 1 kB\nMemAvailable:    3001220 kB\n",
    "sys/devices/platform/soc/soc:firmware/get_throttled": "50000\n",
    "sys/class/thermal/thermal_zone0/type": "cpu-thermal\n",
    "sys/class/thermal/thermal_zone0/temp": "78900\n",
    "sys/class/thermal/thermal_zone0/trip_point_0_type": "critical\n",
    "sys/class/thermal/thermal_zone0/trip_point_0_temp": "110000\n",
    "sys/class/thermal/thermal_zone0/trip_point_1_type": "active\n",
    "sys/class/thermal/thermal_zone0/trip_point_1_temp": "50000\n",
    "sys/devices/system/cpu/cpufreq/policy0/scaling_driver": "cpufreq-dt\n",
    "sys/devices/system/cpu/cpufreq/policy0/scaling_governor": "powersave\n",
    "sys/class/net/wlan0/wireless/x": "",
    "sys/class/net/wlan0/operstate": "up\n",
    "sys/class/net/wlan1/phy80211/x": "",
    "sys/class/net/wlan1/operstate": "down\n",
    "sys/class/net/eth0/operstate": "up\n",
}


def planted(root: Path, files: Mapping[str, str]) -> Path:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


def programs(folder: Path, monkeypatch: pytest.MonkeyPatch, **said: str) -> None:
    folder.mkdir()
    for name, text in said.items():
        script = folder / name
        script.write_text(f"#!/bin/sh\n{text}\n")
        script.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))


async def by_check(root: Path) -> dict[str, Finding]:
    return {one.check.removeprefix("machine."): one async for one in board_checks.board_checks(root)}


async def test_a_raspberry_pi_in_trouble_is_told_piece_by_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs(
        tmp_path / "bin", monkeypatch, iw="echo 'Power save: on'", timedatectl="echo no", vcgencmd="echo throttled=0x0"
    )
    found = await by_check(planted(tmp_path, PI_TREE))
    assert found["model"].facts["model"] == "Raspberry Pi 4 Model B Rev 1.5"
    assert {name: one.code for name, one in found.items() if one.status != "skipped"} == {
        "model": "check.ok",
        "power": "check.undervoltage",
        "temperature": "check.hot",
        "governor": "check.slow_governor",
        "wifi": "check.wifi_power_save",
        "memory": "check.ok",
        "clock": "check.clock_not_synchronized",
    }
    assert found["wifi"].facts == {"powerSave": {"wlan0": True}}
    assert found["memory"].facts["availableBytes"] == 3001220 * 1024


async def test_where_the_kernel_does_not_tell_the_firmwares_program_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs(tmp_path / "bin", monkeypatch, vcgencmd="echo throttled=0x50005")
    planted(tmp_path, {"proc/device-tree/model": PI_TREE["proc/device-tree/model"]})
    assert await board_checks.throttled_bits(tmp_path) == 0x50005


@pytest.mark.parametrize("said", ["exit 1", "echo VCHI initialization failed", "echo throttled="])
async def test_a_program_that_fails_tells_nothing(said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs(tmp_path / "bin", monkeypatch, vcgencmd=said)
    planted(tmp_path, {"proc/device-tree/model": PI_TREE["proc/device-tree/model"]})
    assert await board_checks.throttled_bits(tmp_path) is None


async def test_a_program_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs(tmp_path / "bin", monkeypatch, iw="exec /bin/sleep 60")
    monkeypatch.setattr(board_checks, "PROGRAM_TIMEOUT_S", 0.05)
    assert await board_checks.power_save("wlan0") is None


async def test_a_machine_that_tells_nothing_is_judged_by_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs(tmp_path / "bin", monkeypatch)
    assert {one.status for one in (await by_check(tmp_path)).values()} == {"skipped"}


async def test_nonsense_in_the_kernels_files_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs(tmp_path / "bin", monkeypatch, timedatectl="echo perhaps")
    nonsense = {name: "\x00\xff nonsense: \n:\n" for name in PI_TREE if not name.endswith("/x")}
    found = await by_check(planted(tmp_path, nonsense))
    assert {one.status for one in found.values()} <= {"ok", "skipped"}


def test_a_pc_names_itself_in_its_firmwares_tables(tmp_path: Path) -> None:
    assert (
        board_checks.board_model(planted(tmp_path, {"sys/class/dmi/id/product_name": "NUC11PAHi5\n"})) == "NUC11PAHi5"
    )


def test_only_devices_of_a_group_are_looked_at_and_buses_of_boards_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planted(tmp_path, {f"dev/{name}": "" for name in ("video0", "ttyUSB0", "i2c-1", "null", "dri/renderD128")})
    monkeypatch.setattr(Path, "group", lambda path: "root" if path.name == "ttyUSB0" else f"of-{path.name}")
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "video0")
    on_pc = board_checks.device_accesses(tmp_path, Board("PC"))
    assert [(one.path, one.is_usable) for one in on_pc] == [("/dev/video0", False), ("/dev/dri/renderD128", True)]
    on_board = board_checks.device_accesses(tmp_path, Board("Raspberry Pi 5"))
    assert [one.path for one in on_board if one not in on_pc] == ["/dev/i2c-1"]
