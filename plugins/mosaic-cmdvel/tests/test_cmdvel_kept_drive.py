"""A device may fail at any time and a command may hang at any place: the robot goes on, and a stop stays a stop."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING

import pytest
from support.devices.absence import hasty, tries_in_thirty_seconds

from mosaic_cmdvel.kept_drive import KeptDrive
from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.contract.handler import Refused
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.messages import STANDSTILL, Twist

if TYPE_CHECKING:
    from conftest import ScriptedDrive

IN_TIME_S = 5.0
FORWARD = Twist.planar(x_mps=0.5)
LEFT = Twist.planar(yaw_radps=0.5)
UNPLUGGED = "base-drive: the drive can't be used: OSError: unplugged; tries again at once"


@pytest.fixture
def receiver() -> Iterator[ThreadPoolExecutor]:
    """The receiver's one thread."""
    with ThreadPoolExecutor(1) as pool:
        yield pool


@pytest.fixture
def kept(drive: ScriptedDrive) -> KeptDrive:
    return KeptDrive("base", drive, retry=BackoffPolicy(0.001, max_s=0.001))


def refusal(future: Future[None]) -> str:
    error = future.exception(IN_TIME_S)
    assert isinstance(error, Refused)
    return error.code


def test_the_device_opens_with_a_stop_and_closes_with_one(kept: KeptDrive, drive: ScriptedDrive) -> None:
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        assert (drive.opened, drive.stops) == (1, 1)
        kept.apply(FORWARD)
        assert drive.velocity == FORWARD

    assert (drive.velocity, drive.stops, drive.closed) == (STANDSTILL, 2, 1)
    assert not kept.is_open


def test_commands_are_refused_before_the_robot_starts_and_after_it_ended(kept: KeptDrive) -> None:
    with pytest.raises(Refused, match="isn't open; trying again"):
        kept.apply(FORWARD)
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
    with pytest.raises(Refused, match="isn't open"):
        kept.apply(FORWARD)


def test_a_stop_without_a_device_is_no_error(kept: KeptDrive, drive: ScriptedDrive) -> None:
    kept.stop()

    assert drive.stops == 0


def test_a_device_that_cannot_be_opened_is_told_once_and_tried_again(
    kept: KeptDrive, drive: ScriptedDrive, caplog: pytest.LogCaptureFixture
) -> None:
    drive.open_error = FileNotFoundError("no /dev/ttyACM0")
    with caplog.at_level(logging.INFO), kept:
        assert drive.wait_for(lambda: drive.opened >= 3)
        with pytest.raises(Refused, match="isn't open") as caught:
            kept.apply(FORWARD)
        assert caught.value.code == "plugin.no_device"
        drive.open_error = None
        assert kept.wait_until_open(IN_TIME_S)
        kept.apply(FORWARD)

    assert [record.message for record in caplog.records] == [
        "base-drive: the drive can't be used: FileNotFoundError: no /dev/ttyACM0; tries again at once",
        "base-drive: the device is back",
    ]


def test_a_device_that_is_away_for_thirty_seconds_takes_no_commands_and_starts_with_a_stop(
    drive: ScriptedDrive, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO), KeptDrive("base", drive, retry=hasty(RETRY)) as kept:
        assert kept.wait_until_open(IN_TIME_S)
        kept.apply(FORWARD)
        drive.apply_error = drive.open_error = drive.stop_error = OSError("unplugged")
        with pytest.raises(Refused, match="the drive failed; opening it again"):
            kept.apply(FORWARD)
        often = drive.opened + tries_in_thirty_seconds(RETRY)
        assert drive.wait_for(lambda: drive.opened >= often)
        with pytest.raises(Refused, match="isn't open; trying again"):
            kept.apply(FORWARD)
        drive.apply_error = drive.open_error = drive.stop_error = None
        assert kept.wait_until_open(IN_TIME_S)
        assert drive.velocity == STANDSTILL
        kept.apply(FORWARD)
        assert drive.velocity == FORWARD

    assert caplog.messages == [UNPLUGGED, "base-drive: the device is back"]


def test_a_device_lost_while_driving_is_opened_again_and_starts_with_a_stop(
    kept: KeptDrive, drive: ScriptedDrive, caplog: pytest.LogCaptureFixture
) -> None:
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        drive.apply_error = OSError("unplugged")
        with pytest.raises(Refused, match="the drive failed; opening it again"):
            kept.apply(FORWARD)
        assert drive.wait_for(lambda: drive.opened == 2 and drive.stops == 3)
        assert kept.wait_until_open(IN_TIME_S)
        drive.apply_error = None
        kept.apply(FORWARD)
        assert drive.velocity == FORWARD

    assert UNPLUGGED in caplog.messages


def test_a_stop_that_the_device_did_not_take_is_repeated_by_opening_it_again(
    kept: KeptDrive, drive: ScriptedDrive
) -> None:
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        kept.apply(FORWARD)
        drive.stop_error = OSError("unplugged")
        kept.stop()
        drive.stop_error = None
        assert drive.wait_for(lambda: drive.stops >= 2)
        assert drive.velocity == STANDSTILL


def test_a_drive_may_refuse_a_command_without_being_lost(kept: KeptDrive, drive: ScriptedDrive) -> None:
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        drive.apply_error = Refused("safety.stale", "bumper pressed")
        with pytest.raises(Refused, match="bumper pressed"):
            kept.apply(FORWARD)
        assert kept.is_open


def test_leaving_while_a_command_hangs_stops_and_closes(
    kept: KeptDrive, drive: ScriptedDrive, receiver: ThreadPoolExecutor
) -> None:
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        drive.hang = threading.Event()
        late = receiver.submit(kept.apply, FORWARD)
        assert drive.hanging.wait(IN_TIME_S)

    assert (drive.closed, drive.velocity) == (1, STANDSTILL)
    drive.hang.set()
    late.result(IN_TIME_S)
    kept.stop()  # as the framework says when a command returns that a stop overtook
    assert drive.velocity == STANDSTILL, "also where the device is closed already"


def test_a_device_lost_by_a_failing_command_is_stopped_before_it_is_closed(drive: ScriptedDrive) -> None:
    kept = KeptDrive("base", drive, retry=BackoffPolicy(IN_TIME_S, max_s=IN_TIME_S))
    with kept:
        assert kept.wait_until_open(IN_TIME_S)
        kept.apply(FORWARD)
        drive.apply_error = OSError("one wheel does not answer")
        with pytest.raises(Refused, match="the drive failed"):
            kept.apply(LEFT)
        assert drive.wait_for(lambda: drive.closed == 1)
        assert drive.velocity == STANDSTILL, "long before it is opened again"
        with pytest.raises(Refused, match="the drive isn't open"):
            kept.apply(LEFT)


def test_no_command_slips_in_after_the_last_stop(
    kept: KeptDrive, drive: ScriptedDrive, receiver: ThreadPoolExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    late: list[Future[None]] = []
    stop = drive.stop

    def stop_and_command() -> None:
        stop()
        if drive.stops == 2:  # the one before closing
            late.append(receiver.submit(kept.apply, FORWARD))
            late[0].exception(IN_TIME_S)

    monkeypatch.setattr(drive, "stop", stop_and_command)
    with kept:
        assert kept.wait_until_open(IN_TIME_S)

    assert refusal(late[0]) == "plugin.no_device"
    assert drive.velocity == STANDSTILL
