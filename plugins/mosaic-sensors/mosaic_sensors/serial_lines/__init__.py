"""Devices on a serial line that speak in lines: JSON or text, and take commands as lines."""
