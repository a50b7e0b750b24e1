"""Modbus devices: registers read, and written within limits."""
