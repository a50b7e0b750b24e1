"""ArduPilot and PX4 vehicles over MAVLink 2: one link for all connectors of a vehicle."""
