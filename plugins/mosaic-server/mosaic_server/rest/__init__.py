"""The REST interface: the original's routes and envelope, and a few of our own."""
