"""Pins of a Raspberry Pi: inputs, outputs and hobby servos."""
