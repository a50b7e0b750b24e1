"""Devices that connectors keep open while the robot runs."""
