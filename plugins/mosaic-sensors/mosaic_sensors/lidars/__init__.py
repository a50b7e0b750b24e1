"""Turning laser scanners on a serial line."""
