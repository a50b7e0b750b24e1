"""Sensors for MOSAIC: host load, GPS (NMEA) and JSON from any process."""
