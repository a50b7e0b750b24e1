"""The text line that carries wheel speeds to a motor controller, and the serial port it goes through.

One line per command, ASCII: ``L<rad/s> R<rad/s>\\n``, e.g. ``L3.250 R-1.000\\n``. Every line is complete in itself;
a controller ignores empty and torn lines and stands still when no line comes for half a second.
"""

from __future__ import annotations

import threading

import serial

from mosaic_cmdvel.kinematics import WheelSpeeds

WRITE_TIMEOUT_S = 0.05
"""A port that takes no 20 bytes in this time is broken; longer would delay a stop."""


def wheel_line(wheels: WheelSpeeds) -> bytes:
    """The line for ``wheels``, in steps of 0.001 rad/s."""
    # + 0.0 turns a rounded -0.0 into 0.0
    return f"L{round(wheels.left_radps, 3) + 0.0:.3f} R{round(wheels.right_radps, 3) + 0.0:.3f}\n".encode()


class WheelPort:
    """An open serial port; both methods may be called from any thread and return within 2 × WRITE_TIMEOUT_S."""

    def __init__(self, port: str, baud: int) -> None:
        """Raises :class:`serial.SerialException` (an :class:`OSError`) when it can't be opened, or another program
        drives through it already."""
        self._serial = serial.serial_for_url(
            port, baudrate=baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True
        )
        self._writing = threading.Lock()

    def send(self, wheels: WheelSpeeds) -> None:
        """Write one line. Raises :class:`serial.SerialException` when the port does not take it in time."""
        self._write(wheel_line(wheels))

    def send_stop(self) -> None:
        """Throw away what still waits in the port, end a torn line, and write zero."""
        self._serial.reset_output_buffer()
        self._write(b"\n" + wheel_line(WheelSpeeds(0.0, 0.0)))

    def _write(self, line: bytes) -> None:
        # A write ends within its own time-out, so that this lock is free in time; if not, a torn line is the
        # smaller evil than no stop.
        locked = self._writing.acquire(timeout=WRITE_TIMEOUT_S)
        try:
            self._serial.write(line)
        finally:
            if locked:
                self._writing.release()

    def close(self) -> None:
        self._serial.close()
