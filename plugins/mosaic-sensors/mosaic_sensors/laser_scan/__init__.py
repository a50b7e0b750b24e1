"""Laser scans: what a plugin of one's own derives from and calls."""

from mosaic_sensors.laser_scan.compact_form import decoded_scan, encoded_scan
from mosaic_sensors.laser_scan.scan import Scan, json_of, scan_of, scan_of_json
from mosaic_sensors.laser_scan.sender import LaserScanParams, LaserScanSender

__all__ = [
    "LaserScanParams",
    "LaserScanSender",
    "Scan",
    "decoded_scan",
    "encoded_scan",
    "json_of",
    "scan_of",
    "scan_of_json",
]
