"""Velocity commands for MOSAIC: receiver, kinematics and drives."""
