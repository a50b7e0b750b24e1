"""``mosaic arm calibrate``: guides a person who moves the arm by hand, then keeps what was found in motors and file."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import typer

from mosaic_arm.calibration import MotorCalibration, read_calibration, write_calibration
from mosaic_arm.commands.calibrating import RangeRecorder, middle_offset
from mosaic_arm.params import ArmParams
from mosaic_arm.servos.bus import ServoBus
from mosaic_arm.servos.opening import bus_of
from mosaic_core import DeviceGone

PERIOD_S = 0.05
SHOW_EVERY = 10
READS = 10


class EnterKey:
    """Waits for Enter on a thread of its own, so that motors are read meanwhile. The end of the input is no Enter:
    nobody holds the arm there."""

    def __init__(self, read_line: Callable[[], str] = lambda: sys.stdin.readline()) -> None:
        self._pressed = threading.Event()
        self._is_over = False
        self._read_line = read_line
        threading.Thread(target=self._read, name="mosaic-arm-enter", daemon=True).start()

    def _read(self) -> None:
        self._is_over = not self._read_line()
        self._pressed.set()

    def was_pressed(self, within_s: float) -> bool:
        """Raises :class:`typer.Abort` when there is nobody who could press it."""
        pressed = self._pressed.wait(within_s)
        if pressed and self._is_over:
            raise typer.Abort
        return pressed


def calibrate(
    params: ArmParams, path: Path, full_turn: list[str], enter: Callable[[], EnterKey] = EnterKey,
    bus: ServoBus | None = None,
) -> dict[str, MotorCalibration]:  # fmt: skip
    """Guide, store and write; the motors are off all the time. Raises :class:`~mosaic_core.MosaicError`."""
    ids = {name: one.id for name, one in params.joints.items()}
    plain = [MotorCalibration(id=motor, range_min=0, range_max=4095) for motor in ids.values()]
    with bus or bus_of(params, plain) as opened:
        _all_there(opened, ids, params.port)
        typer.echo(f"HOLD THE ARM: its motors go off, and its {params.weight_kg:g} kg fall. Then press Enter.")
        _wait(enter())
        opened.set_torque(list(ids.values()), on=False)
        opened.store_calibration(plain)  # what was kept before must not hide where the motors are
        typer.echo("Move every joint to the middle of its range, then press Enter.")
        _wait(enter())
        is_added = params.bus == "dynamixel"
        middles = _ticks(opened, ids)
        offsets = {name: middle_offset(ticks, is_added=is_added) for name, ticks in middles.items()}
        opened.store_calibration(
            [one.model_copy(update={"homing_offset": offsets[name]}) for name, one in zip(ids, plain, strict=True)]
        )
        recorder = RangeRecorder(full_turn)
        typer.echo("Move every joint from one end to the other, then press Enter.")
        _record(opened, ids, recorder, enter())
        found = recorder.calibrations(ids, offsets)
        opened.store_calibration(list(found.values()))
    write_calibration(path, found)
    typer.echo(f"{path} is written, and the motors keep it. They are still off.")
    return found


def write_to_motors(params: ArmParams, path: Path, bus: ServoBus | None = None) -> None:
    """Keep what the file says in the motors, which must be let go for it."""
    ids = {name: one.id for name, one in params.joints.items()}
    joints = list(read_calibration(path, ids).values())
    with bus or bus_of(params, joints) as opened:
        _all_there(opened, ids, params.port)
        opened.set_torque(list(ids.values()), on=False)
        opened.store_calibration(joints)
    typer.echo(f"the motors on {params.port} keep what {path} says")


def _all_there(bus: ServoBus, ids: Mapping[str, int], port: str) -> None:
    missing = set(bus.missing())
    if missing:
        names = ", ".join(f"{motor} ({name})" for name, motor in ids.items() if motor in missing)
        raise DeviceGone(
            f"motors on {port} do not answer: {names}", "Look at supply, cables, numbers, --bus and --baud."
        )


def _wait(key: EnterKey) -> None:
    while not key.was_pressed(PERIOD_S):
        pass


def _record(bus: ServoBus, ids: Mapping[str, int], recorder: RangeRecorder, key: EnterKey) -> None:
    turn = 0
    while True:
        recorder.saw(_ticks(bus, ids))
        if key.was_pressed(PERIOD_S):
            return
        if turn % SHOW_EVERY == 0:
            typer.echo("  ".join(f"{name} {low}–{high}" for name, (low, high) in recorder.seen.items()))
        turn += 1


def _ticks(bus: ServoBus, ids: Mapping[str, int]) -> dict[str, int]:
    """Where all joints are; a reply that is lost is asked for again."""
    for _ in range(READS):
        found = bus.read()
        if all(motor in found for motor in ids.values()):
            return {name: found[motor].ticks for name, motor in ids.items()}
        time.sleep(PERIOD_S)
    silent = ", ".join(name for name, motor in ids.items() if motor not in found)
    raise DeviceGone(f"these joints tell no position: {silent}", "Look at their cables.")
