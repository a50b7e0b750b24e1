"""The drives that come along: log, unicycle over a real pseudo terminal, callback."""

from __future__ import annotations

import logging
import os
import select
import tty
from collections.abc import Iterator

import pytest
import serial

from mosaic_cmdvel.drives.callback import CallbackDrive, CallbackParams
from mosaic_cmdvel.drives.log import LogDrive, LogParams
from mosaic_cmdvel.drives.unicycle import UnicycleDrive, UnicycleParams
from mosaic_cmdvel.drives.wheel_line import wheel_line
from mosaic_cmdvel.kinematics import WheelSpeeds
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.messages import STANDSTILL, Twist


@pytest.fixture
def controller() -> Iterator[tuple[int, str]]:
    """The motor controller's end of a serial line, and the name of ours."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


def received(controller: int, lines: int) -> list[str]:
    data = b""
    while data.count(b"\n") < lines:
        assert select.select([controller], [], [], 5.0)[0], f"only {data!r} arrived"
        data += os.read(controller, 1024)
    return data.decode().splitlines()


def unicycle(port: str, max_wheel_radps: float | None = None) -> UnicycleDrive:
    params = UnicycleParams(
        type="unicycle", wheel_radius_m=0.1, track_width_m=0.5, port=port, max_wheel_radps=max_wheel_radps
    )
    return UnicycleDrive(params, Shared())


def test_wheel_speeds_go_to_the_controller_line_by_line(controller: tuple[int, str]) -> None:
    with unicycle(controller[1]) as drive:
        drive.apply(Twist.planar(x_mps=0.5, yaw_radps=1.0))
        assert received(controller[0], 1) == ["L2.500 R7.500"]
        drive.stop()
        assert received(controller[0], 2)[-1] == "L0.000 R0.000"


def test_wheels_are_slowed_alike(controller: tuple[int, str]) -> None:
    with unicycle(controller[1], max_wheel_radps=3.0) as drive:
        drive.apply(Twist.planar(x_mps=0.5, yaw_radps=1.0))
        assert received(controller[0], 1) == ["L1.000 R3.000"]


def test_a_port_that_does_not_exist_fails_on_opening_and_not_before() -> None:
    drive = unicycle("/dev/no-such-port")

    with pytest.raises(serial.SerialException, match="no-such-port"), drive:
        pytest.fail("opened")


def test_a_port_through_which_another_program_drives_is_not_shared(controller: tuple[int, str]) -> None:
    with unicycle(controller[1]), pytest.raises(serial.SerialException, match="lock"), unicycle(controller[1]):
        pytest.fail("opened twice")


def test_a_closed_unicycle_takes_no_command(controller: tuple[int, str]) -> None:
    drive = unicycle(controller[1])
    with drive:
        pass

    with pytest.raises(ConnectionError, match="is closed"):
        drive.apply(STANDSTILL)


def flood(drive: UnicycleDrive) -> None:
    for _ in range(100_000):
        drive.apply(Twist.planar(x_mps=0.5))


def test_a_controller_that_reads_nothing_makes_writing_fail_instead_of_hang(controller: tuple[int, str]) -> None:
    with unicycle(controller[1]) as drive:
        with pytest.raises(serial.SerialException):
            flood(drive)
        drive.stop()  # what waited is thrown away, so that the stop finds room


def test_a_line_has_no_negative_zero() -> None:
    assert wheel_line(WheelSpeeds(-0.0, -0.0004)) == b"L0.000 R0.000\n"


def test_the_unicycle_can_log_instead(caplog: pytest.LogCaptureFixture) -> None:
    params = UnicycleParams(type="unicycle", wheel_radius_m=0.1, track_width_m=0.5, output="log")
    with caplog.at_level(logging.INFO), UnicycleDrive(params, Shared()) as drive:
        drive.apply(Twist.planar(x_mps=0.5))
        drive.apply(Twist.planar(x_mps=0.5))
        drive.stop()
        drive.stop()

    assert caplog.messages == [
        "wheels: left 5.00 rad/s, right 5.00 rad/s",
        "wheels: left 0.00 rad/s, right 0.00 rad/s",
    ]


def test_the_log_drive_logs_changes_and_not_the_state(caplog: pytest.LogCaptureFixture) -> None:
    drive = LogDrive(LogParams(type="log"), Shared())
    with caplog.at_level(logging.INFO):
        for x in (0.5, 0.5, 0.55, 0.7):
            drive.apply(Twist.planar(x_mps=x))
        drive.stop()
        drive.stop()

    assert caplog.messages == [
        "x 0.50 m/s, y 0.00 m/s, yaw 0.00 rad/s",
        "x 0.70 m/s, y 0.00 m/s, yaw 0.00 rad/s",
        "x 0.00 m/s, y 0.00 m/s, yaw 0.00 rad/s",
    ]


def test_the_callback_is_called_with_every_command_and_with_standstill_to_stop() -> None:
    called: list[Twist] = []
    drive = CallbackDrive(CallbackParams(function=called.append), Shared())
    drive.apply(Twist.planar(x_mps=0.5))
    drive.stop()

    assert called == [Twist.planar(x_mps=0.5), STANDSTILL]
