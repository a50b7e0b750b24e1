"""Runs one handler alone, on a fake clock: without a robot, a network, a thread or a wait.

The kit for plugin authors (``mosaic_core.testing``) offers it, and the ladder judges plugins by it.
"""
