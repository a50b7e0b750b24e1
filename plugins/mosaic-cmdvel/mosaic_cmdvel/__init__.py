"""Velocity commands for MOSAIC: receiver, kinematics and drives."""

from mosaic_cmdvel.drive import Drive, DriveParams

__all__ = ["Drive", "DriveParams"]
