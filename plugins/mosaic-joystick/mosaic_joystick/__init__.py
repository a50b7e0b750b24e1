"""Joysticks, gamepads and 3D mice: told to operators, and driven by."""
