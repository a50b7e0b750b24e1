"""A simulated robot for MOSAIC, and `mosaic demo`."""
