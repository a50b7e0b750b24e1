"""Runs inside the robot: drives that write down what they were told, and when on the clock of this machine.

`function: "drive_recorder:record_NAME"` makes one of any name. Every process of a machine has the same monotonic clock.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

from mosaic_core.messages import Twist

_FILE = Path(os.environ["DRIVE_RECORD"]).open("ab", buffering=0)  # noqa: SIM115 (open as long as the robot lives)


def __getattr__(attribute: str) -> Callable[[Twist], None]:
    word, _, name = attribute.partition("_")
    if word != "record" or not name:
        raise AttributeError(attribute)

    def record(twist: Twist) -> None:
        """One line in one write, for another process reads along."""
        at_s = time.monotonic()
        _FILE.write(f"{name} {at_s:.6f} {twist.linear.x:.4f} {twist.angular.z:.4f}\n".encode())

    return record
