"""Sensors for MOSAIC: host load, GPS, laser scanners, point clouds, devices on serial lines, JSON from any process."""
