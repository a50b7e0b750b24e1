"""Hear the robot, talk through it: the connectors ``microphone`` and ``speaker``."""
