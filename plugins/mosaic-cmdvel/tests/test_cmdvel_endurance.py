"""A motor controller at the end of a serial line is pulled out while the base drives, or talks without end."""

from __future__ import annotations

import os
import select
import tty
from pathlib import Path

import pytest

from mosaic_cmdvel.drives.unicycle import UnicycleDrive, UnicycleParams
from mosaic_cmdvel.kept_drive import KeptDrive
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Refused
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.messages import Twist

IN_TIME_S = 10.0
FORWARD = Twist.planar(x_mps=0.5)
STOP, DRIVE = "L0.000 R0.000", "L5.000 R5.000"


class Controller:
    """Is plugged in at ``path`` until :meth:`unplug`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        path.symlink_to(os.ttyname(self._theirs))

    def hears(self, wanted: str) -> None:
        """Wait until this line comes."""
        heard = b""
        while wanted not in heard.decode().splitlines():
            assert select.select([self._ours], [], [], IN_TIME_S)[0], f"only {heard!r} arrived"
            heard += os.read(self._ours, 1024)

    def babbles(self) -> int:
        """Say nonsense until nothing more finds room; how many bytes did."""
        said = 0
        try:
            while True:
                said += os.write(self._ours, b"\xff\x00E42\n" * 512)
        except BlockingIOError:
            return said

    def unplug(self) -> None:
        self._path.unlink()
        os.close(self._ours)
        os.close(self._theirs)


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "ttyACM0"


def kept(port: Path) -> KeptDrive:
    params = UnicycleParams(type="unicycle", wheel_radius_m=0.1, track_width_m=0.5, port=str(port))
    return KeptDrive("base", UnicycleDrive(params, Shared()), retry=BackoffPolicy(0.01, max_s=0.01))


def test_a_controller_that_is_pulled_out_while_it_drives_begins_with_a_stop_when_it_returns(port: Path) -> None:
    controller = Controller(port)
    with kept(port) as drive:
        assert drive.wait_until_open(IN_TIME_S)
        drive.apply(FORWARD)
        controller.hears(DRIVE)
        controller.unplug()
        for _ in range(6):  # of what an operator says meanwhile nothing comes later
            with pytest.raises(Refused):
                drive.apply(FORWARD)
        again = Controller(port)
        again.hears(STOP)
        assert drive.wait_until_open(IN_TIME_S)
        drive.apply(FORWARD)
        again.hears(DRIVE)
    again.hears(STOP)
    again.unplug()


def test_a_controller_that_talks_without_end_is_driven_and_stopped_all_the_same(port: Path) -> None:
    controller = Controller(port)
    with kept(port) as drive:
        assert drive.wait_until_open(IN_TIME_S)
        assert controller.babbles() > 0
        drive.apply(FORWARD)
        controller.hears(DRIVE)
        drive.stop()
        controller.hears(STOP)
    controller.unplug()
