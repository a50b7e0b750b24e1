"""Keeps a drive's device open for the robot's life, and stops it before it is closed and after it was opened.

Three threads meet here: the *receiver's* calls :meth:`KeptDrive.apply`, the robot's *safety* thread (or any other)
calls :meth:`KeptDrive.stop`, and one thread of our own, the *keeper*, opens the device, tries again when it is lost,
and closes it.

A stop that overtakes a command is the framework's: it says :meth:`KeptDrive.stop` again when the command returns, and
while it hangs.
"""

from __future__ import annotations

import logging
import threading
from typing import Any, Self

from mosaic_cmdvel.drive import Drive
from mosaic_core.contract.handler import Refused
from mosaic_core.messages import Twist

_log = logging.getLogger(__name__)

RETRY_S = (0.5, 1.0, 2.0, 5.0)
"""Waits between attempts to open a device; the last one repeats. A replugged USB adapter is back within seconds."""
CLOSE_TIMEOUT_S = 1.0
"""A device that does not close in this time is abandoned: a robot shuts down within 2 s."""


class KeptDrive:
    """Keeps a drive and opens its device again after a failure. Enter it with the robot (``Shared``); entering never
    fails and never blocks."""

    def __init__(self, label: str, drive: Drive[Any], retry_s: tuple[float, ...] = RETRY_S) -> None:
        self._label = label
        self._drive = drive
        self._retry_s = retry_s
        self._changed = threading.Condition()
        self._is_open = False
        self._is_lost = False
        self._is_closing = False
        self._attempts = 0
        self._was_applied = False
        self._keeper: threading.Thread | None = None

    @property
    def is_open(self) -> bool:
        return self._is_open

    def wait_until_open(self, timeout_s: float) -> bool:
        """Block until commands are taken; ``False`` when that took too long."""
        with self._changed:
            return self._changed.wait_for(lambda: self._is_open, timeout_s)

    def __enter__(self) -> Self:
        self._is_closing = False
        self._keeper = threading.Thread(target=self._keep, name=f"{self._label}-drive", daemon=True)
        self._keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        if self._keeper is not None:
            self._keeper.join(CLOSE_TIMEOUT_S)
            if self._keeper.is_alive():
                _log.error("%s: the drive did not close within %s s and was abandoned", self._label, CLOSE_TIMEOUT_S)

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
            self._attempts = 0
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
        """The device failed: log the change, and let the keeper close it and open it again."""
        with self._changed:
            if self._is_open:
                _log.error("%s: lost the drive: %s: %s; opening it again", self._label, type(error).__name__, error)
            self._is_open, self._is_lost = False, True
            self._changed.notify_all()

    def _keep(self) -> None:
        failed_before = False
        while True:
            try:
                with self._drive:
                    self._drive.stop()  # a controller may still carry out what a crashed program told it
                    self._opened(failed_before)
                    self._attend()
            except Exception as error:  # noqa: BLE001 - a device may fail in any way; reported and tried again
                self._open_failed(error, failed_before)
            failed_before = True
            retry_s = self._retry_s[min(self._attempts, len(self._retry_s) - 1)]
            self._attempts += 1
            with self._changed:
                if self._changed.wait_for(lambda: self._is_closing, retry_s):
                    return

    def _opened(self, failed_before: bool) -> None:
        with self._changed:
            self._is_open, self._is_lost = True, False
            self._changed.notify_all()
        if failed_before:
            _log.warning("%s: the drive is back", self._label)

    def _open_failed(self, error: Exception, failed_before: bool) -> None:
        with self._changed:
            self._is_open = False
        if not failed_before:
            _log.error("%s: the drive can't be opened: %s: %s; trying again", self._label, type(error).__name__, error)

    def _attend(self) -> None:
        """Wait until the device is lost or the robot ends."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closing or self._is_lost)
        self._last_stop()

    def _last_stop(self) -> None:
        """Before closing, also a device that was lost: a command that failed half-way may have set it moving."""
        with self._changed:
            self._is_open = False  # first: no command begins after this stop
        try:
            self._drive.stop()
        except Exception as error:  # noqa: BLE001 - a lost device may take no stop any more; opening it repeats it
            level = logging.DEBUG if self._is_lost else logging.ERROR
            _log.log(level, "%s: the drive did not take the last stop: %r", self._label, error)
