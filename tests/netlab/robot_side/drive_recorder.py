"""Runs inside the robot: a drive that writes down what it was told, and when on the clock of this machine."""

from __future__ import annotations

import os
import time
from pathlib import Path

from mosaic_cmdvel import Twist

_FILE = Path(os.environ["DRIVE_RECORD"]).open("ab", buffering=0)  # noqa: SIM115 (open as long as the robot lives)


def record(twist: Twist) -> None:
    """One line in one write: another process reads along. Every process of a machine has the same monotonic clock."""
    _FILE.write(f"{time.monotonic():.6f} {twist.linear_x_mps:.4f} {twist.angular_z_radps:.4f}\n".encode())
