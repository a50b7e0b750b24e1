"""Velocity commands for MOSAIC: receiver, kinematics and drives."""

from mosaic_cmdvel.drive import Drive, DriveParams
from mosaic_cmdvel.twist import STANDSTILL, Twist, limited

__all__ = ["STANDSTILL", "Drive", "DriveParams", "Twist", "limited"]
