"""`mosaic demo`: server and simulated robot on this machine, with nothing to set up and nothing left behind."""
