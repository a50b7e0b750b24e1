"""A handler whose device is kept open by a keeper is away while the device is: its row, its commands and its safe
action say so, and nothing is a bug."""

from __future__ import annotations

import inspect
import logging
import threading
from collections.abc import Iterator
from typing import Any, Self

import pytest

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DeviceGone,
    Keeper,
    Message,
    NoParams,
    Shared,
)
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.runtime.handlers import handler_runs
from mosaic_core.testing import Joined, Silence, build, connector, feed, joined, until

SOON = BackoffPolicy(0.01, max_s=0.01, jitter=0.0)


class Speed(Message):
    speed_mps: float


class Motor:
    """Its controller is plugged in or not."""

    def __init__(self, *, is_plugged: bool = True, starts: bool = True) -> None:
        self.is_plugged, self.is_open, self._starts = is_plugged, False, starts
        self.told: list[float] = []
        self.keeper = Keeper("motor", self._turn, retry=SOON)

    def __enter__(self) -> Self:
        if self._starts:
            self.keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.keeper.stop()

    def _turn(self) -> float | None:
        if not self.is_open:
            self._write(0.0)
            self.is_open = True
        return None

    def drive(self, speed_mps: float) -> None:
        if not self.is_open:
            raise DeviceGone("the motor is not open")
        self._write(speed_mps)

    def _write(self, speed_mps: float) -> None:
        if not self.is_plugged:
            self.is_open = False
            raise DeviceGone("no motor", "plug it in")
        self.told.append(speed_mps)


class Drive(DataChannelReceivable[Speed]):
    timeout_s = 0.3
    motion_fields = ("speed_mps",)

    def __init__(self, label: str, motor: Motor) -> None:
        super().__init__(label)
        self.motor, self.keeper = motor, motor.keeper

    def handle_data(self, data: Speed) -> None:
        self.motor.drive(data.speed_mps)

    def make_safe(self, cause: str) -> None:
        self.motor.drive(0.0)


class DriveConfigurer(DataChannelConfigurer[NoParams]):
    """Drives."""

    def configure(self) -> Drive:
        return Drive(self.label, self.shared.get("acme:motor", lambda: Motor()))


def kept_by(motor: Motor) -> type[DriveConfigurer]:
    class Kept(DriveConfigurer):
        def configure(self) -> Drive:
            return Drive(self.label, self.shared.get("acme:motor", lambda: motor))

    return Kept


def row(link: Joined) -> Any:
    (found,) = (one for one in link.robot.snapshot().connectors if one.label == "drive")
    return found


def lines(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [message for message in caplog.messages if "drive" in message]


@pytest.fixture
def log(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    with caplog.at_level(logging.INFO):
        yield caplog


async def test_a_device_that_is_away_at_the_start_is_told_once_and_so_is_its_return(
    log: pytest.LogCaptureFixture,
) -> None:
    motor = Motor(is_plugged=False)
    async with joined(connector(kept_by(motor), label="drive")) as link:
        await until(lambda: row(link).failures > 3)
        assert (row(link).state, row(link).failure_code) == ("failed", "plugin.no_device")
        assert row(link).last_error == "no motor; plug it in"
        assert row(link).tries_again_in_s is not None
        motor.is_plugged = True
        await until(lambda: row(link).state == "running")
        assert row(link).failure_code == ""
    told = "connector 'drive': no motor; plug it in (plugin.no_device); tries again at once"
    assert lines(log)[:2] == [told, "connector 'drive' is back"]
    assert not [message for message in log.messages if message.startswith("motor")], "nobody says it twice"
    assert motor.told[0] == 0.0


async def test_a_command_that_finds_it_gone_is_refused_and_a_stick_held_until_its_return_moves_nothing(
    log: pytest.LogCaptureFixture,
) -> None:
    motor = Motor()
    async with joined(connector(kept_by(motor), label="drive")) as link:
        store = link.connection.sendable("drive")
        await store.wait_open()
        await until(lambda: motor.is_open)
        motor.is_plugged = False
        store.send_json({"speed_mps": 0.5})
        await until(lambda: row(link).state == "failed")
        store.send_json({"speed_mps": 0.5})
        await until(lambda: row(link).refused_by == {"handler": 1, "rest": 1})
        assert row(link).failure_code == "plugin.no_device"
        motor.is_plugged = True
        await until(lambda: row(link).state == "running")
        store.send_json({"speed_mps": 0.25})
        await until(lambda: row(link).refused_by.get("stop", 0) == 1)
        store.send_json({"speed_mps": 0.0})
        store.send_json({"speed_mps": 0.25})
        await until(lambda: 0.25 in motor.told)
    assert not [record for record in log.records if record.exc_info]


async def test_a_safe_action_that_waits_for_its_device_has_no_traceback_and_runs_when_it_is_back(
    log: pytest.LogCaptureFixture,
) -> None:
    motor = Motor()
    async with joined(connector(kept_by(motor), label="drive")) as link:
        store = link.connection.sendable("drive")
        await store.wait_open()
        store.send_json({"speed_mps": 0.5})
        await until(lambda: 0.5 in motor.told)
        motor.is_plugged = False
        await until(lambda: any("waits for its device" in line for line in lines(log)))
        motor.is_plugged = True
        await until(lambda: any("works again" in line for line in lines(log)))
        assert motor.told[-1] == 0.0
    assert not [record for record in log.records if record.exc_info]


async def test_a_robot_ends_without_an_error_while_its_device_is_away(log: pytest.LogCaptureFixture) -> None:
    async with joined(connector(kept_by(Motor(is_plugged=False)), label="drive")) as link:
        await until(lambda: row(link).state == "failed")
    assert [line for line in lines(log) if "waits for its device" in line]
    assert not [record.message for record in log.records if record.levelno >= logging.ERROR]


@pytest.mark.parametrize("has_failed", [False, True])
async def test_a_safe_action_that_hangs_at_the_end_is_told_although_its_device_is_away(
    has_failed: bool, log: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(handler_runs, "_SAFE_PATIENCE_S", 0.3)
    may_end, motor, tried = threading.Event(), Motor(is_plugged=False), list[str]()

    class Hangs(Drive):
        def make_safe(self, cause: str) -> None:
            if has_failed and not tried:
                tried.append(cause)
                raise DeviceGone("the motor does not answer")
            may_end.wait()

    class HangsConfigurer(DataChannelConfigurer[NoParams]):
        """Hangs."""

        def configure(self) -> Hangs:
            return Hangs(self.label, self.shared.get("acme:motor", lambda: motor))

    async with joined(connector(HangsConfigurer, label="drive")) as link:
        await until(lambda: row(link).state == "failed")
    may_end.set()
    assert "the safe action of 'drive' did not end within 0.3 s (safety.shutdown)" in log.messages


async def test_a_keeper_that_nobody_started_is_told(log: pytest.LogCaptureFixture) -> None:
    async with joined(connector(kept_by(Motor(starts=False)), label="drive")):
        pass
    (told,) = [line for line in lines(log) if "keeper" in line]
    assert f"'drive' ({__file__}:{inspect.getsourcelines(Drive)[1]}): its keeper was not started" in told
    assert "Call its start() in __enter__" in told


async def test_who_has_left_the_robot_hears_of_the_device_no_more(log: pytest.LogCaptureFixture) -> None:
    motor = Motor()
    async with joined(connector(kept_by(motor), label="drive")):
        await until(lambda: motor.is_open)
    motor.keeper.lost(DeviceGone("unplugged"))
    assert not [line for line in lines(log) if "unplugged" in line]


def test_the_kit_refuses_what_finds_the_device_gone_and_makes_nothing_safe_that_is_away() -> None:
    motor, shared = Motor(), Shared()
    shared.get("acme:motor", lambda: motor)
    handler = build(DriveConfigurer, shared=shared)
    with shared.entered():
        until_open(motor)
        motor.is_plugged = False
        fed = feed(handler, [Speed(speed_mps=0.5), Silence(1.0)])
    assert [(one.code, one.message) for one in fed.refused] == [("plugin.no_device", "no motor; plug it in")]
    assert (fed.accepted, fed.made_safe) == ([], [])
    assert motor.keeper.absence is not None


def until_open(motor: Motor) -> None:
    while not motor.is_open:
        motor.keeper.wake()
