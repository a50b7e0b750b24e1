"""What connectors share, and keep open while the robot runs."""
