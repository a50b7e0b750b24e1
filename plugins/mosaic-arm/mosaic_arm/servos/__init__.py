"""Buses of serial servos: packets, registers, the serial line, and a bus that is made up."""
