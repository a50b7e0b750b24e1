"""What a board's firmware and kernel say is judged: power, heat, clock rate, radio, permissions, memory."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.diagnosis.board_verdicts import (
    LEAST_AVAILABLE_BYTES,
    Board,
    DeviceAccess,
    ThermalZone,
    access_finding,
    clock_finding,
    governor_finding,
    heat_finding,
    memory_finding,
    model_finding,
    power_finding,
    wifi_finding,
)

PI = Board("Raspberry Pi 5 Model B Rev 1.0")
JETSON = Board("NVIDIA Jetson Orin Nano Developer Kit")
PC = Board("NUC11PAHi5")


@pytest.mark.parametrize(
    ("board", "page"),
    [(PI, "raspberry-pi"), (JETSON, "jetson"), (PC, "x86"), (Board(""), "x86"), (Board("Jetson-AGX"), "jetson")],
)
def test_a_model_leads_to_its_page(board: Board, page: str) -> None:
    assert board.page == f"docs/howto/{page}.md"
    told = model_finding(board)
    assert told.status == ("ok" if board.model else "skipped")
    assert board.page in told.sentence or not board.model


@pytest.mark.parametrize(
    ("bits", "status", "code", "word"),
    [
        (0, "ok", "check.ok", "Never"),
        (0x50005, "fail", "check.undervoltage", "at this moment"),
        (0x50000, "warn", "check.undervoltage", "since the start"),
        (0xE0008, "warn", "check.throttled", "at this moment"),
        (0xE0000, "warn", "check.throttled", "since the start"),
        (0x20002, "warn", "check.throttled", "at this moment"),
        (0x10004, "warn", "check.throttled", "at this moment"),
        (None, "skipped", "check.skipped", "does not tell"),
    ],
)
def test_power_is_judged_by_the_firmwares_bits(bits: int | None, status: str, code: str, word: str) -> None:
    found = power_finding(bits, PI)
    assert (found.status, found.code) == (status, code)
    assert word in found.sentence


@given(st.integers(0, 0xFFFFF))
def test_only_a_lack_of_voltage_at_this_moment_fails(bits: int) -> None:
    assert (power_finding(bits, PI).status == "fail") == bool(bits & 1)
    assert (power_finding(bits, PI).status == "ok") == (bits & 0xF000F == 0)


@pytest.mark.parametrize(
    ("board", "zone", "status"),
    [
        (PI, ThermalZone("cpu-thermal", 75.0, (110.0,)), "ok"),
        (PI, ThermalZone("cpu-thermal", 75.1, (110.0,)), "warn"),
        (JETSON, ThermalZone("tj-thermal", 94.1, (99.0, 104.5)), "warn"),
        (JETSON, ThermalZone("tj-thermal", 93.9, (99.0, 104.5)), "ok"),
        (PC, ThermalZone("acpitz", 20.0, (0.0, 16.8, 5000.0)), "ok"),
        (PC, ThermalZone("x86_pkg_temp", 99.0), "ok"),
    ],
)
def test_heat_is_judged_by_the_limit_that_is_nearest(board: Board, zone: ThermalZone, status: str) -> None:
    assert heat_finding([ThermalZone("cool", 20.0, (100.0,)), zone], board).status == status


def test_without_sensors_heat_is_not_judged() -> None:
    assert heat_finding([], PC).status == "skipped"


@pytest.mark.parametrize(
    ("pairs", "status"),
    [
        ([("cpufreq-dt", "ondemand")], "ok"),
        ([("cpufreq-dt", "schedutil"), ("cpufreq-dt", "powersave")], "warn"),
        ([("intel_pstate", "powersave")], "ok"),
        ([("intel_cpufreq", "powersave")], "warn"),
        ([], "skipped"),
    ],
)
def test_a_governor_that_never_rises_is_told(pairs: list[tuple[str, str]], status: str) -> None:
    assert governor_finding(pairs, PC).status == status


def test_a_radio_that_sleeps_is_told_with_its_name() -> None:
    found = wifi_finding({"wlan0": False, "wlp2s0": True}, PI)
    assert (found.status, found.code) == ("warn", "check.wifi_power_save")
    assert "iw dev wlp2s0 set power_save off" in found.cure
    assert wifi_finding({"wlan0": False}, PI).status == "ok"
    assert wifi_finding({"wlan0": None}, PI).status == "skipped"
    assert wifi_finding({}, PI).status == "skipped"


def test_a_device_that_is_shut_names_the_group_or_the_new_login() -> None:
    shut, entered = DeviceAccess("/dev/video0", "video", False), DeviceAccess("/dev/ttyACM0", "dialout", False, True)
    assert "`sudo usermod -aG video $USER`" in access_finding([shut, entered], PC).cure
    assert access_finding([entered], PC).cure.startswith("Log in again.")
    assert access_finding([DeviceAccess("/dev/video0", "video", True)], PC).status == "ok"
    assert access_finding([], PC).status == "skipped"
    many = [DeviceAccess(f"/dev/video{number}", "video", False) for number in range(20)]
    assert access_finding(many, PC).sentence.count("/dev/") == 4
    assert "others" in access_finding(many, PC).sentence


@pytest.mark.parametrize(
    ("available", "status"), [(LEAST_AVAILABLE_BYTES, "ok"), (LEAST_AVAILABLE_BYTES - 1, "warn"), (None, "skipped")]
)
def test_little_memory_is_told(available: int | None, status: str) -> None:
    assert memory_finding(available, 2**30, PC).status == status


@pytest.mark.parametrize(("state", "status"), [(True, "ok"), (False, "warn"), (None, "skipped")])
def test_a_clock_that_nothing_keeps_is_told(state: bool | None, status: str) -> None:
    assert clock_finding(state, PI).status == status


def test_whatever_is_wrong_names_the_page_of_the_board() -> None:
    wrong = (
        power_finding(1, PI), heat_finding([ThermalZone("cpu", 99.0)], PI), governor_finding([("", "powersave")], PI),
        wifi_finding({"wlan0": True}, PI), access_finding([DeviceAccess("/dev/i2c-1", "i2c", False)], PI),
        memory_finding(1, 2, PI), clock_finding(False, PI),
    )  # fmt: skip
    assert all(one.cure.endswith("See docs/howto/raspberry-pi.md.") for one in wrong)
