"""The MOSAIC server: signaling, accounts, robots, and the dashboard."""
