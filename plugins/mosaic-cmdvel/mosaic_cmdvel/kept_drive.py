"""Keeps a drive's device open for the robot's life, and stops it before it is closed and after it was opened.

Three threads meet here: the *receiver's* calls :meth:`KeptDrive.apply`, the robot's *safety* thread (or any other)
calls :meth:`KeptDrive.stop`, and that of the keeper opens the device, tries again when it is lost, and closes it.

A stop that overtakes a command is the framework's: it says :meth:`KeptDrive.stop` again when the command returns, and
while it hangs.
"""

from __future__ import annotations

import logging
import threading
from typing import Any

from mosaic_cmdvel.drive import Drive
from mosaic_core.contract.devices.keeper import RETRY, Keeper
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_core.contract.handler import Refused
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.messages import Twist
from mosaic_core.words.errors import DeviceGone

_log = logging.getLogger(__name__)


class KeptDrive(KeptDevice):
    """Keeps a drive and opens its device again after a failure. Enter it with the robot (``Shared``); entering never
    fails and never blocks."""

    def __init__(self, label: str, drive: Drive[Any], retry: BackoffPolicy = RETRY) -> None:
        self._label = label
        self._drive = drive
        self._changed = threading.Condition()
        self._is_open = False
        self._is_lost = False
        self._was_applied = False
        self.keeper = Keeper(f"{label}-drive", self._turn, retry=retry)

    @property
    def is_open(self) -> bool:
        return self._is_open

    def wait_until_open(self, timeout_s: float) -> bool:
        """Block until commands are taken; ``False`` when that took too long."""
        with self._changed:
            return self._changed.wait_for(lambda: self._is_open, timeout_s)

    def apply(self, twist: Twist) -> None:
        """Hand ``twist`` to the drive. Receiver's thread, one at a time.

        Raises :class:`Refused` with ``plugin.no_device`` while the device is away.
        """
        with self._changed:
            if not self._is_open:
                raise Refused("plugin.no_device", "the drive isn't open; trying again")
            self._was_applied = True
        try:
            self._drive.apply(twist)
        except Refused:
            raise
        except Exception as error:
            self._lose(error)
            raise Refused("plugin.no_device", "the drive failed; opening it again") from error

    def stop(self) -> None:
        """Stand still now. Any thread; takes as long as the drive's ``stop``."""
        if not (self._is_open or self._was_applied):
            return  # opening begins with a stop, closing ends with one; but a command may return after the last
        try:
            self._drive.stop()
        except Exception as error:  # noqa: BLE001 - a device may fail in any way; opening it again repeats the stop
            self._lose(error)

    def _lose(self, error: Exception) -> None:
        """The device failed: the keeper shall close it and open it again."""
        with self._changed:
            was_open, self._is_open, self._is_lost = self._is_open, False, True
        if was_open:
            self.keeper.lost(_gone(error))

    def _turn(self) -> float:
        """Open the device and wait until it is lost, or the robot ends."""
        try:
            with self._drive:
                self._drive.stop()  # a controller may still carry out what a crashed program told it
                self._opened()
                while not (self._is_lost or self.keeper.wait()):
                    pass
                self._last_stop()
        except Exception as error:  # a device may fail in any way
            with self._changed:
                self._is_open = False
            raise _gone(error) from error
        return self.keeper.failed()

    def _opened(self) -> None:
        self.keeper.worked()
        with self._changed:
            self._is_open, self._is_lost = True, False
            self._changed.notify_all()

    def _last_stop(self) -> None:
        """Before closing, also a device that was lost: a command that failed half-way may have set it moving."""
        with self._changed:
            self._is_open = False  # first: no command begins after this stop
        try:
            self._drive.stop()
        except Exception as error:  # noqa: BLE001 - a lost device may take no stop any more; opening it repeats it
            level = logging.DEBUG if self._is_lost else logging.ERROR
            _log.log(level, "%s: the drive did not take the last stop: %r", self._label, error)


def _gone(error: Exception) -> DeviceGone:
    return DeviceGone(f"the drive can't be used: {type(error).__name__}: {error}")
